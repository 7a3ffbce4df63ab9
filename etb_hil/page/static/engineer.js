// The engineer's view: one run or two, their steps, measurements and signals, files to download, and an explanation.

import { draw } from "./chart.js";
import { element, limitText, showTroubles, valueText } from "./parts.js";
import { readTable, thinned, valueAt } from "./signals.js";
import { stepResult } from "./steps.js";
import { clock, DEGREES, inDegrees, keep, language, loadWords, measured, number, recall, say, sayOr, shown } from "./words.js";

const $ = (id) => document.getElementById(id);
const FIRST_SHOWN = ["throttle_angle", "command_position", "motor_current"];
const RUNS = ["a", "b"];

let about = null, you = {}, isOpen = false, window_s = null, cursors = [null, null], switched = new Set(FIRST_SHOWN);
const results = { a: null, b: null }, signals = { a: null, b: null }, chosen = { a: "", b: "" };
const loading = new Set();  // the runs whose signals are on their way

// Fill a table. A cell is a text, or a text and its classes. On a phone each row is a card: its cells say their column.
function fill(name, head, rows) {
  const cells = (kind, row) => row.map((cell, column) => {
    const [text, classes] = Array.isArray(cell) ? cell : [cell, ""], made = element(kind, text, classes);
    if (kind === "td") made.dataset.label = [head[column]].flat()[0];
    return made;
  });
  const line = (kind, row) => { const made = element("tr"); made.append(...cells(kind, row)); return made; };
  $(`${name}_head`).replaceChildren(line("th", head));
  $(name).replaceChildren(...rows.map((row) => line("td", row)));
}

async function ask(what, order = {}) {
  $("said").textContent = "";
  const answer = await fetch(`/api/${what}`, { method: "POST", body: JSON.stringify(order) }).catch(() => null);
  if (answer?.status === 401) return location.assign("/login");
  if (answer?.ok) return;
  const { why = "too_many", said = "" } = answer ? await answer.json().catch(() => ({})) : { why: "not_reached" };
  $("said").textContent = say(why, { name: about?.holder.name ?? "", said });
}

const isTesting = () => about && (about.status === "starting" || about.status === "running");

function connect() {
  const socket = new WebSocket(`${location.origin.replace(/^http/, "ws")}/live`);
  socket.onmessage = (event) => {
    const told = JSON.parse(event.data), was = isTesting();
    if (!isOpen) { isOpen = true; showLink(); }
    if (!told.about) return;
    about = told.about;
    you = told.you;
    document.body.dataset.status = about.status;
    showTroubles(about);
    showChoices();
    showExplaining();
    showResults();
    if (was && !isTesting()) for (const which of RUNS) if (!signals[which]) loadSignals(which);
  };
  socket.onclose = (event) => {
    isOpen = false;
    showLink();
    if (event.code === 4401) location.assign("/login");
    else setTimeout(connect, 1000);
  };
}

function showLink() {
  $("link").hidden = isOpen;
  $("link").textContent = isOpen ? "" : say("no_link");
}

// ---------------------------------------------------------------- which runs

const runsKnown = () => about.recent.runs.filter((run) => run.has_session);

function named(run) {
  const word = run.outcome === "ok" ? run.verdict : run.outcome;
  return `${new Date(run.started).toLocaleString(language, { dateStyle: "short", timeStyle: "medium" })} · ${run.serial || run.run_id} · ${say(`verdict_${word}`)}`;
}

function showChoices() {
  const runs = runsKnown(), wanted = new URLSearchParams(location.search);
  for (const which of RUNS) {
    const options = runs.map((run) => Object.assign(element("option", named(run)), { value: run.run_id }));
    if (which === "b") options.unshift(Object.assign(element("option", say("none")), { value: "" }));
    $(which).replaceChildren(...options);
    const value = chosen[which] || wanted.get(which) || (which === "a" ? runs[0]?.run_id ?? "" : "");
    if (value && !options.some((one) => one.value === value)) $(which).prepend(Object.assign(element("option", value), { value }));
    $(which).value = value;
    if (value !== chosen[which]) choose(which, value);
  }
}

async function choose(which, run) {
  chosen[which] = run;
  results[which] = signals[which] = null;
  const url = new URL(location);
  for (const one of RUNS) if (chosen[one]) url.searchParams.set(one, chosen[one]); else url.searchParams.delete(one);
  history.replaceState(null, "", url);
  if (which === "a") showFiles();
  if (run) {
    const answer = await fetch(`/results/${encodeURIComponent(run)}`).catch(() => null);
    if (chosen[which] !== run) return;
    results[which] = answer?.ok ? await answer.json() : null;
    loadSignals(which);
  }
  showResults();
  showSignals();
}

// ---------------------------------------------------------------- steps and measurements

const verdictCell = (one) => (one?.verdict ? [`${{ pass: "✓", fail: "✗" }[one.verdict] ?? "?"} ${say(`verdict_${one.verdict}`)}`, one.verdict] : "");

function showResults() {
  const { a, b } = results, two = Boolean(b);
  const stepsHead = [say("step"), say("from_to"), say("result"), ...(two ? [`${say("from_to")} (B)`, `${say("result")} (B)`] : [])];
  const ids = [...new Set(RUNS.flatMap((which) => results[which]?.phases.map((one) => one.id) ?? []))];
  const cells = (result, id) => {
    const phase = result?.phases.find((one) => one.id === id);
    if (!phase) return ["–", "–"];
    return [`${number(phase.start_s, 4)} … ${phase.end_s === null ? "" : number(phase.end_s, 4)} s`, stepResult(result, phase, about?.bench.kinds)];
  };
  fill("steps", stepsHead, ids.map((id) => [sayOr(`phase ${id}`, id.replaceAll("_", " ")), ...cells(a, id), ...(two ? cells(b, id) : [])]));
  const codes = (result) => (!result.unit_diagnostics?.codes_after ? say("codes_not_read") : result.unit_diagnostics.codes_after.map((one) => one.code).join(", ") || say("codes_none"));
  $("codes").textContent = RUNS.filter((which) => results[which]).map((which) => `${which.toUpperCase()}: ${codes(results[which])}`).join(" · ");
  const head = [say("measurement"), [`${say("value")} A`, "n"], [say("limit_head"), "n"], say("judged"), ...(two ? [[`${say("value")} B`, "n"], say("judged"), [`${say("difference")} B − A`, "n"]] : [])];
  const by = (result) => new Map((result?.measurements ?? []).map((one) => [one.id, one]));
  const left = by(a), right = by(b);
  fill("compared", head, [...new Set([...left.keys(), ...right.keys()])].map((id) => {
    const one = left.get(id), other = right.get(id), any = one ?? other;
    const both = one?.value != null && other?.value != null && one.unit === other.unit;
    return [measured(id, any.name), [one ? valueText(one) : "–", "n"], [limitText(any), "n"], verdictCell(one),
      ...(two ? [[other ? valueText(other) : "–", "n"], verdictCell(other), [both ? shown(other.value - one.value, one.unit) : "–", "n"]] : [])];
  }));
}

// ---------------------------------------------------------------- files and explanation

function showFiles() {
  for (const kind of ["blf", "mf4", "csv"]) $(kind).href = `/download/${encodeURIComponent(chosen.a)}.${kind}`;
  $("report").href = `/report/${encodeURIComponent(chosen.a)}`;
  $("explanation").href = `/explanation/${encodeURIComponent(chosen.a)}`;
  $("files").hidden = !chosen.a;
  showExplaining();
}

function showExplaining() {
  if (!about) return;
  const { run_id: run, status, said } = about.explaining, known = runsKnown().find((one) => one.run_id === chosen.a);
  $("explain").disabled = !you.holds || isTesting() || status === "running";
  $("explain_stop").hidden = status !== "running" || !you.holds;
  $("explanation").hidden = !(known?.is_explained || (status === "done" && run === chosen.a));
  $("explaining").textContent = status === "none" ? (you.holds ? "" : say("not_holder")) : say(`explain_${status}`, { run, said: sayOr(`explanation ${said}`, said) });
}

// ---------------------------------------------------------------- many logs

let replays = null;

async function followReplays() {
  const answer = await fetch("/api/replays").catch(() => null);
  if (answer?.ok) replays = await answer.json();
  showReplays();
  setTimeout(followReplays, 2000);
}

function showReplays() {
  $("replays").hidden = !replays;
  if (!replays) return;
  const { wrong, done, total, failures, failed = [], ended, left_s: left, age_s: age } = replays;
  $("replays_bar").hidden = Boolean(wrong);
  $("replays_failed").hidden = !failed.length;
  if (wrong) { $("replays_state").textContent = wrong; return; }
  Object.assign($("replays_bar"), { max: Math.max(1, total), value: done });
  const said = [say("logs_done", { done, total })];
  if (failures) said.push(say("logs_failed", { count: failures }));
  if (ended) said.push(say("logs_ended"));
  else {
    if (left !== null) said.push(say("left", { time: clock(left) }));
    said.push(say("last_news", { time: clock(age) }));
  }
  $("replays_state").textContent = said.join(" · ");
  fill("failed_logs", [say("log"), say("why")], failed.map((one) => [one.path, one.error || one.status]));
}

// ---------------------------------------------------------------- signals

async function loadSignals(which) {
  const run = chosen[which];
  if (!run) return;
  if (isTesting()) { $("signals_state").textContent = say("signals_wait"); return; }
  loading.add(run);
  $("signals_state").textContent = say("signals_loading");
  const answer = await fetch(`/download/${encodeURIComponent(run)}.csv`).catch(() => null);
  const text = answer?.ok ? await answer.text() : "";
  loading.delete(run);
  $("signals_state").textContent = loading.size ? say("signals_loading") : text ? "" : say("signals_none");
  if (chosen[which] !== run) return;
  signals[which] = text ? readTable(text) : null;
  showSignals();
}

function wholeRun() {
  const ends = RUNS.flatMap((which) => [...(signals[which]?.values() ?? [])].map((one) => one.times.at(-1) ?? 0));
  return [0, Math.max(1, ...ends)];
}

const nameOf = (name) => sayOr(`signal ${name}`, name.replaceAll("_", " "));

function showSignals() {
  const known = new Map([...(signals.b ?? []), ...(signals.a ?? [])]);
  if ($("switches").childElementCount !== known.size || $("switches").dataset.language !== language) {
    $("switches").dataset.language = language;
    $("switches").replaceChildren(...[...known.keys()].map((name) => {
      const label = element("label"), box = Object.assign(element("input"), { type: "checkbox", checked: switched.has(name), value: name });
      box.addEventListener("change", () => { if (box.checked) switched.add(name); else switched.delete(name); showSignals(); });
      label.append(box, element("span", nameOf(name)));
      return label;
    }));
  }
  const names = [...known.keys()].filter((name) => switched.has(name));
  for (const plot of [...$("plots").children]) if (!names.includes(plot.dataset.signal)) plot.remove();
  for (const name of names) {
    if ([...$("plots").children].some((one) => one.dataset.signal === name)) continue;
    const canvas = element("canvas");
    canvas.dataset.signal = name;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", say("signal_alt", { name: nameOf(name) }));
    followPointer(canvas);
    $("plots").append(canvas);
  }
  drawSignals();
}

let scale = null;

function drawSignals() {
  const [from, to] = window_s ?? wholeRun();
  if (document.activeElement !== $("from")) $("from").value = from.toFixed(3);
  if (document.activeElement !== $("to")) $("to").value = to.toFixed(3);
  for (const canvas of $("plots").children) {
    const name = canvas.dataset.signal, unit = (signals.a?.get(name) ?? signals.b?.get(name)).unit;
    const isAngle = unit.startsWith("rad"), factor = isAngle ? DEGREES : 1;
    const series = ["b", "a"].filter((which) => signals[which]?.has(name)).map((which) => ({
      kind: "line", colour: which === "a" ? "--line" : "--second", dash: which === "a" ? [] : [6, 4], width: 1.6,
      points: thinned(signals[which].get(name), from, to, canvas.clientWidth || 800, factor),
    }));
    const marks = cursors.flatMap((x, index) => (x === null ? [] : [{ x, colour: index ? "--unsure" : "--good" }]));
    const shownUnit = isAngle ? inDegrees(unit) : unit === "1" ? "" : unit === "degC" ? "°C" : unit;
    scale = draw(canvas, { series, marks, x: [from, to], xLabel: say("axis_time"), yLabel: [nameOf(name), shownUnit].filter(Boolean).join(", "), xTick: (v) => number(v, 6), yTick: (v) => number(v, 4) }) ?? scale;
  }
  showCursors();
}

function showCursors() {
  cursors.forEach((at, index) => { const field = $(`cursor_${index + 1}`); if (document.activeElement !== field) field.value = at === null ? "" : at.toFixed(4); });
  const lines = [];
  for (const canvas of $("plots").children) for (const which of RUNS) {
    const signal = signals[which]?.get(canvas.dataset.signal);
    if (!signal || cursors.every((at) => at === null)) continue;
    const [one, other] = cursors.map((at) => (at === null ? null : valueAt(signal, at)));
    const text = (value) => (value === null ? "–" : shown(value, signal.unit, 5));
    lines.push([`${nameOf(canvas.dataset.signal)}${signals.b ? ` (${which.toUpperCase()})` : ""}`, [text(one), "n"], [text(other), "n"], [one === null || other === null ? "–" : text(other - one), "n"]]);
  }
  fill("cursors", [say("signal"), [say("at_cursor_1"), "n"], [say("at_cursor_2"), "n"], [say("difference"), "n"]], lines);
}

function zoom(factor, middle = null) {
  const [from, to] = window_s ?? wholeRun(), at = middle ?? (from + to) / 2;
  setWindow(at - (at - from) * factor, at + (to - at) * factor);
}

function setWindow(from, to) {
  const [first, last] = wholeRun(), low = Math.max(first, Math.min(from, to)), high = Math.min(last, Math.max(from, to));
  if (!(high - low > 1e-4)) return;
  window_s = low <= first && high >= last ? null : [low, high];
  drawSignals();
}

function followPointer(canvas) {
  let pressed = null;
  const timeAt = (event) => scale?.valueAt(event.offsetX) ?? 0;
  canvas.addEventListener("pointerdown", (event) => { pressed = [event.offsetX, timeAt(event)]; canvas.setPointerCapture(event.pointerId); });
  canvas.addEventListener("pointerup", (event) => {
    if (!pressed) return;
    const [x, time] = pressed;
    pressed = null;
    if (Math.abs(event.offsetX - x) > 5) return setWindow(time, timeAt(event));
    cursors[event.shiftKey ? 1 : 0] = time;
    drawSignals();
  });
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(event.deltaY < 0 ? 0.7 : 1 / 0.7, timeAt(event)); }, { passive: false });
}

// ---------------------------------------------------------------- what the engineer does

for (const which of RUNS) $(which).addEventListener("change", () => choose(which, $(which).value));
for (const id of ["from", "to"]) $(id).addEventListener("change", () => { if ($("from").value && $("to").value) setWindow(Number($("from").value), Number($("to").value)); });
[0, 1].forEach((index) => $(`cursor_${index + 1}`).addEventListener("change", (event) => { cursors[index] = event.target.value === "" ? null : Number(event.target.value); drawSignals(); }));
$("zoom_in").addEventListener("click", () => zoom(0.5));
$("zoom_out").addEventListener("click", () => zoom(2));
$("whole_run").addEventListener("click", () => { window_s = null; drawSignals(); });
$("explain").addEventListener("click", () => ask("explain", { run_id: chosen.a }));
$("explain_stop").addEventListener("click", () => ask("explain/stop"));
$("language").addEventListener("change", async () => { await loadWords($("language").value); showAll(); });
$("theme").addEventListener("change", () => { keep("theme", $("theme").value); showAll(); });
addEventListener("resize", drawSignals);

function showAll() {
  document.documentElement.dataset.theme = $("theme").value;
  if (about) { showChoices(); showExplaining(); }
  showResults();
  showReplays();
  showSignals();
  showLink();
}

await loadWords();
$("language").value = language;
$("theme").value = recall("theme") ?? "auto";
showAll();
connect();
followReplays();
