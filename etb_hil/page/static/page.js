// The operator page: what the server tells is shown, what the operator does is asked of the server.

import { draw } from "./chart.js";
import { element, isKnown, limitText, passedLimit, showTroubles, takes, valueText } from "./parts.js";
import { CODE, listen } from "./scanner.js";
import { DEGREES, inDegrees, clock, keep, language, loadWords, measured, number, recall, say, sayOr, shown } from "./words.js";

const $ = (id) => document.getElementById(id);
const MOST_POINTS = 5000;
const SIGNS = {
  PASS: ["M12 1a11 11 0 1 0 0 22 11 11 0 0 0 0-22z", "M6.5 12.5l3.7 3.7 7.3-8.2"],
  FAIL: ["M7.5 1.5h9l6 6v9l-6 6h-9l-6-6v-9z", "M8 8l8 8M16 8l-8 8"],
  INCONCLUSIVE: ["M12 .8L23.2 12 12 23.2.8 12z", "M9.3 9.6a2.8 2.8 0 1 1 4.1 2.5c-1 .5-1.4 1-1.4 2.1M12 17v.2"],
  "BENCH FAULT": ["M12 1.5L23.5 22H.5z", "M12 9v6M12 18.4v.2"],
  ABORTED: ["M2 2h20v20H2z", "M8 8h8v8H8z"],
  STOPPED: ["M2 2h20v20H2z", "M8 8h8v8H8z"],
  REFUSED: ["M12 1a11 11 0 1 0 0 22 11 11 0 0 0 0-22z", "M6 12h12"],
};

let about = null, you = {}, news = {}, points = [], shownRun = -1, heardMs = 0, isOpen = false, armed = "", heardSerial = "";

async function ask(what, order = {}, body = JSON.stringify(order)) {
  $("said").textContent = "";
  try {
    const answer = await fetch(`/api/${what}`, { method: "POST", body });
    if (answer.ok) return true;
    if (answer.status === 401) return location.assign("/login"), false;
    const { why = "too_many", said = "" } = await answer.json().catch(() => ({}));
    $("said").textContent = say(why, { name: about?.holder.name ?? "", said });
  } catch {
    $("said").textContent = say("not_reached");
  }
  return false;
}

// ---------------------------------------------------------------- what the server tells

function connect() {
  const socket = new WebSocket(`${location.origin.replace(/^http/, "ws")}/live`);
  socket.onmessage = (event) => {
    heardMs = performance.now();
    isOpen = true;
    const told = JSON.parse(event.data);
    if (told.about) {
      if (told.about.number !== shownRun) { points = []; shownRun = told.about.number; }
      about = told.about;
      you = told.you;
      showAbout();
    }
    news = told.news;
    points.push(...news.points);
    if (points.length > MOST_POINTS) points.splice(0, points.length - MOST_POINTS);
    showLink();
    requestAnimationFrame(showNews);
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

const isRunning = () => about.status === "starting" || about.status === "running";

function showAbout() {
  const { bench, run, holder } = about;
  document.body.dataset.status = about.status;
  document.body.dataset.run = about.number;
  document.title = [about.outcome && !isRunning() ? headline(about.outcome) : "", bench.bench].filter(Boolean).join(" - ");
  $("bench").textContent = bench.station ? `${bench.station} · ${bench.bench}` : bench.bench;
  $("health").textContent = bench.unfit ? `${say("not_fit")}: ${bench.unfit}` : bench.is_virtual ? say("virtual_bench") : say("fit");
  $("health").className = bench.unfit ? "bad" : "";
  $("holder").textContent = holder.name ? say(you.holds ? "you_hold" : "held_by", { name: holder.name }) : say("nobody_holds");
  $("release").hidden = !you.holds;
  $("logout").hidden = !you.may_leave;
  $("take").hidden = you.holds;
  $("taken").textContent = holder.name && !you.holds ? say(holder.is_here ? "held_wait" : "held_away", { name: holder.name }) : "";
  $("order").hidden = !you.holds || isRunning();
  $("stop").disabled = $("end").disabled = !isRunning();
  $("end").hidden = !isRunning();
  showChoice($("scenario"), bench.scenarios.map((one) => [one.name, one.title]), "friction_check");
  showChoice($("unit"), bench.units.map((one) => [one, one]), "default");
  $("what").textContent = [run.serial, run.part, run.scenario, run.operator].filter(Boolean).join(" · ") || say("no_run_yet");
  showTroubles(about);
  showPhases();
  showVerdict();
  showRecent();
  showPart();
}

function showChoice(select, choices, first) {
  const label = document.querySelector(`label[for="${select.id}"]`);
  select.hidden = label.hidden = !choices.length;
  if (select.options.length === choices.length) return;
  select.replaceChildren(...choices.map(([value, text]) => Object.assign(element("option", text), { value })));
  const wanted = recall(select.id) ?? first;
  if (choices.some(([value]) => value === wanted)) select.value = wanted;
}

const headline = (outcome) => say(`headline_${outcome.headline}`);

function showVerdict() {
  const outcome = about.outcome;
  $("verdict").hidden = !outcome || isRunning();
  if ($("verdict").hidden) return;
  $("verdict").className = { PASS: "pass", FAIL: "fail" }[outcome.headline] ?? (outcome.tone === "fault" ? "fault" : "unsure");
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 24 24");
  svg.setAttribute("aria-hidden", "true");
  SIGNS[outcome.headline].forEach((d, index) => {
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
    path.setAttribute("d", d);
    path.setAttribute("class", index ? "inner" : "outer");
    svg.append(path);
  });
  $("sign").replaceChildren(svg);
  $("headline").textContent = headline(outcome);
  $("headline").style.setProperty("--letters", headline(outcome).length);
  $("whose").textContent = [say("serial_short"), about.run.serial].join(" ");
  const [reason, next] = worded(outcome);
  $("reason").textContent = reason;
  $("next_text").textContent = next;
  $("next").hidden = !next;
  const further = outcome.further.map((text) => sayOr(`sentence ${text}`, text));
  if (reason !== outcome.reason) further.unshift(outcome.reason);  // the bench's own words hold more: places, names, numbers
  $("further").replaceChildren(...further.map((text) => element("li", text)));
  if (outcome.is_safe === false) $("further").prepend(element("li", say("not_seen_off"), "bad"));
  $("report").hidden = !outcome.has_report;
  $("report").href = `/report/${encodeURIComponent(outcome.session)}`;
  $("again").hidden = !you.holds;
}

// Return reason and next step in the page's language, or as the bench said them where it has no words for them.
function worded(outcome) {
  const said = [outcome.reason, sayOr(`next ${outcome.next_step}`, outcome.next_step)], id = outcome.reason_id;
  if (language === "en") return said;
  const plain = sayOr(`reason ${id}`, "");
  if (plain) return [plain, said[1]];
  const one = outcome.measurements.find((each) => id.startsWith(`${each.id}_`)), general = one ? sayOr(`reason *${id.slice(one.id.length)}`, "") : "";
  if (!general) return said;
  const filled = { name: measured(one.id, one.name), value: valueText(one), limit: shown(passedLimit(one), one.unit) };
  return [general.replace(/\{(\w+)\}/g, (whole, name) => filled[name] ?? whole), said[1]];
}

function showPhases() {
  const now = news.snapshot?.phase, outcome = isRunning() ? null : about.outcome;
  const phases = outcome?.phases.length ? outcome.phases : about.run.phases ?? [];
  const at = phases.findIndex((one) => one.id === now);
  $("phases").replaceChildren(...phases.slice(0, 200).map((one, index) => {
    const state = outcome ? (one.end_s === null || one.end_s === undefined ? "broken" : "done") : index < at ? "done" : index === at ? "now" : "ahead";
    const item = element("li", "", state);
    item.append(element("span", sayOr(`phase ${one.id}`, one.id.replaceAll("_", " "))), element("small", say(`phase_${state}`)));
    if (state === "now") item.setAttribute("aria-current", "step");
    return item;
  }));
  const current = $("phases").querySelector(".now");
  if (current) $("phases").scrollTop = current.offsetTop - $("phases").offsetTop - $("phases").clientHeight / 2;
}

let lastPhase = "";

function showNews() {
  if (!about) return;
  const snapshot = news.snapshot;
  if (snapshot && snapshot.phase !== lastPhase) { lastPhase = snapshot.phase; showPhases(); }
  showPrompt();
  showProgress(snapshot);
  showNumbers(snapshot);
  showFacts(snapshot);
  showCurves();
}

function showProgress(snapshot) {
  const share = about.status === "done" ? (about.outcome?.duration_s ? 1 : 0) : snapshot?.progress ?? 0;
  $("progress").value = share;
  if (!isRunning()) $("left").textContent = about.outcome?.duration_s ? say("lasted", { time: clock(about.outcome.duration_s) }) : "";
  else if (!snapshot) $("left").textContent = say("preparing");
  else if (share >= 0.999) $("left").textContent = say("judging");
  else $("left").textContent = `${Math.round(share * 100)} %` + (snapshot.time_left_s === null ? "" : ` · ${say("left", { time: clock(snapshot.time_left_s) })}`);
}

function judged(value, limit) {
  return value === null || limit === null || limit === undefined ? null : Math.abs(value) <= limit ? "pass" : "fail";
}

function showNumbers(snapshot) {
  let rows = [];
  if (!isRunning() && about.outcome) {
    const urgency = (one) => (one.verdict === null ? 2 : one.verdict === "pass" ? 1 : 0);
    rows = about.outcome.measurements.filter((one) => isKnown(one) || one.verdict).toSorted((a, b) => urgency(a) - urgency(b)).slice(0, 10).map((one) => [
      measured(one.id, one.name), valueText(one), limitText(one), one.verdict]);
  } else if (snapshot) {
    rows = [
      [measured("T_st"), shown(snapshot.stiction, "N·m"), upper(snapshot.stiction_limit), judged(snapshot.stiction, snapshot.stiction_limit)],
      [measured("T_c"), shown(snapshot.coulomb, "N·m"), upper(snapshot.coulomb_limit), judged(snapshot.coulomb, snapshot.coulomb_limit)],
      [say("friction_now"), shown(snapshot.friction, "N·m"), upper(snapshot.friction_limit), judged(snapshot.friction, snapshot.friction_limit)],
      [say("exceedances"), snapshot.exceedances === null ? "–" : String(snapshot.exceedances), "", null],
    ];
  }
  $("numbers").replaceChildren(...rows.map(([name, value, limit, verdict]) => {
    const row = element("tr");
    row.append(element("td", name), element("td", value, "n"), element("td", limit, "n"));
    row.append(verdict ? element("td", `${{ pass: "✓", fail: "✗" }[verdict] ?? "?"} ${say(isRunning() ? `so_far_${verdict}` : `verdict_${verdict}`)}`, verdict) : element("td", ""));
    return row;
  }));
}

const upper = (limit) => (limit === null || limit === undefined ? "" : `≤ ${shown(limit, "N·m")}`);

function showFacts(snapshot) {
  // The last picture of a run was taken before its drive went off.
  const isOff = snapshot?.set_point === null || (!isRunning() && about.outcome?.is_safe === true);
  const facts = snapshot ? [
    ["angle", shown(snapshot.angle, "rad")],
    ["set_point", isOff ? say("drive_off") : shown(snapshot.set_point, "rad")],
    ...(isOff && !isRunning() ? [] : [["current", shown(snapshot.current, "A")]]),
    ["temperature", shown(snapshot.temperature, "degC")],
    ["bus_load", snapshot.load === null ? say("unknown") : `${number(snapshot.load * 100)} %`],
    ["frames_lost", snapshot.lost === null ? say("unknown") : String(snapshot.lost), snapshot.lost > 0],
    ["bus_state", snapshot.bus_state === null ? say("unknown") : sayOr(`bus ${snapshot.bus_state}`, snapshot.bus_state)],
    ["error_frames", snapshot.error_frames === null ? say("unknown") : String(snapshot.error_frames), snapshot.error_frames > 0],
    ["lateness", `${number(snapshot.late_ms)} ms`, snapshot.late_ms > 5],
    ["frame_age", `${number(snapshot.frame_age_ms)} ms`],
  ] : [];
  $("facts").replaceChildren(...facts.flatMap(([key, value, isBad]) => [element("dt", say(key)), element("dd", value, isBad ? "bad" : "")]));
}

function showCurves() {
  const limits = about.run.limits ?? {}, omega = limits.stribeck_velocity == null ? null : limits.stribeck_velocity * DEGREES;
  const far = omega === null ? null : limits.far_above * omega;  // from here on friction is held against the limit of sliding friction
  const speeds = points.filter((point) => point[3] !== null && point[4] !== null).map((point) => [point[3] * DEGREES, point[4]]);
  const fastest = Math.max(60, far === null ? 0 : far * 1.4, ...speeds.map(([speed]) => Math.abs(speed)));
  const lines = [];
  for (const sign of [1, -1]) {
    if (limits.stiction != null) lines.push({ y: sign * limits.stiction, from: -(omega ?? fastest), to: omega ?? fastest, label: sign > 0 ? say("limit_T_st") : "" });
    if (limits.coulomb != null && far !== null) {
      lines.push({ y: sign * limits.coulomb, from: far, to: fastest, label: sign > 0 ? say("limit_T_c") : "" });
      lines.push({ y: sign * limits.coulomb, from: -fastest, to: -far });
    }
  }
  const high = 1.3 * Math.max(0.05, limits.stiction ?? 0, ...speeds.map(([, friction]) => Math.abs(friction)));
  draw($("friction"), {
    series: [{ kind: "dots", colour: "--line", points: speeds }],
    lines, x: [-fastest, fastest], y: [-high, high],
    xLabel: say("axis_speed"), yLabel: say("axis_friction"), xTick: (v) => number(v), yTick: (v) => number(v),
  });
  $("friction").setAttribute("aria-label", say("friction_alt", { count: speeds.length }));
  const [low, top] = about.run.angles ?? [0, Math.PI / 2];
  draw($("angle"), {
    series: [
      { kind: "line", colour: "--second", width: 4, points: points.map((point) => [point[0], point[2] === null ? null : point[2] * DEGREES]) },
      { kind: "line", colour: "--line", points: points.map((point) => [point[0], point[1] === null ? null : point[1] * DEGREES]) },
    ],
    y: [low * DEGREES, top * DEGREES], x: points.length ? undefined : [0, 10],
    xLabel: say("axis_time"), yLabel: say("axis_angle"), xTick: (v) => number(v), yTick: (v) => number(v),
  });
  $("angle").setAttribute("aria-label", say("angle_alt"));
}

// ---------------------------------------------------------------- prompts

let shownPrompt = 0;

function showPrompt() {
  const prompt = isRunning() ? news.prompt : null;
  $("prompt").hidden = !prompt;
  if (!prompt) { shownPrompt = 0; return; }
  const key = `${shownRun}/${prompt.number}/${you.holds}/${language}`, [first] = prompt.answers;
  if (shownPrompt === key) return;
  shownPrompt = key;
  $("prompt_text").textContent = prompt.text;
  const entry = you.holds && prompt.entry ? { text: textEntry, photo: photoEntry }[prompt.entry](prompt) : null;
  $("answers").replaceChildren(...(entry ? [entry] : []), ...prompt.answers.flatMap((answer, index) => {
    if (entry && answer === first) return [];
    const button = element("button", "", index ? "big" : "big go");
    button.type = "button";
    button.append(element("kbd", String(index + 1)), element("span", sayOr(`answer ${answer}`, answer)));
    button.disabled = !you.holds;
    button.addEventListener("click", () => ask("answer", { number: prompt.number, answer }));
    return [button];
  }));
  if (!you.holds) $("answers").append(element("p", say("holder_answers", { name: about.holder.name })));
  ($("entry") ?? $("prompt_text")).focus();
}

// Return a form for the text that a prompt asks for.
function textEntry(prompt) {
  const form = element("form"), field = element("input"), button = element("button", say("send"), "big go");
  Object.assign(field, { id: "entry", maxLength: 200, autocomplete: "off", required: true });
  field.setAttribute("aria-label", prompt.text);
  form.append(field, button);
  form.addEventListener("submit", (event) => { event.preventDefault(); heard(field.value); });
  return form;
}

// Return a button that takes a photo for a prompt, and sends it no larger than a report needs it.
function photoEntry(prompt) {
  const label = element("label", "", "big go"), field = Object.assign(element("input"), { id: "entry", type: "file", accept: "image/*" });
  field.setAttribute("capture", "environment");
  label.append(element("span", say("take_photo")), field);
  field.addEventListener("change", async () => {
    const photo = field.files[0] && (await smaller(field.files[0]));
    if (photo) ask(`photo/${prompt.number}`, {}, photo);
    else if (field.files[0]) $("said").textContent = say("no_photo");
    field.value = "";
  });
  return label;
}

const MOST_PIXELS = 1600;  // of a photo's longer side: a scratch of 0.1 mm on a plate of 100 mm is still there

async function smaller(file) {
  const picture = await createImageBitmap(file).catch(() => null);
  if (!picture) return null;
  const scale = Math.min(1, MOST_PIXELS / Math.max(picture.width, picture.height));
  const canvas = Object.assign(element("canvas"), { width: Math.round(picture.width * scale), height: Math.round(picture.height * scale) });
  canvas.getContext("2d").drawImage(picture, 0, 0, canvas.width, canvas.height);
  return new Promise((done) => canvas.toBlob(done, "image/jpeg", 0.85));
}

// Answer a prompt with what was typed or scanned: the code or number of an answer, or the text that it asks for.
function answerPrompt(code, text) {
  const prompt = news.prompt, answer = prompt.answers[Number(code || (prompt.entry === "text" ? "" : text)) - 1];
  if (!you.holds) return;
  if (answer && !(prompt.entry && answer === prompt.answers[0])) ask("answer", { number: prompt.number, answer });
  else if (!code && prompt.entry === "text") ask("answer", { number: prompt.number, answer: prompt.answers[0], entry: text });
}

// ---------------------------------------------------------------- past

function showRecent() {
  const { runs, judged: count, passed } = about.recent;
  $("yield").textContent = count ? say("yield", { share: number((100 * passed) / count), passed, count }) : say("no_units_yet");
  $("recent").replaceChildren(...runs.map((run) => {
    const row = element("tr");
    const word = run.outcome === "ok" ? run.verdict : run.outcome;
    const sign = { pass: "✓", fail: "✗", inconclusive: "?", fault: "!", aborted: "■" }[word] ?? "?";
    const time = new Date(run.started);
    row.append(element("td", time.toLocaleString(language, { dateStyle: "short", timeStyle: "short" })), element("td", run.serial), element("td", `${sign} ${say(`verdict_${word}`)}`, word));
    const cell = element("td");
    if (run.has_report) cell.append(Object.assign(element("a", say("report")), { href: `/report/${encodeURIComponent(run.run_id)}`, target: "_blank", rel: "noopener" }));
    row.append(cell);
    return row;
  }));
  showHistory();
}

let historyAsked = 0;

async function showHistory() {
  const mine = ++historyAsked;
  const answer = await fetch(`/api/history?measurement=${encodeURIComponent($("which").value || "T_st")}`);
  if (!answer.ok || mine !== historyAsked) return;
  const { measured: ids, values } = await answer.json();
  const chosen = $("which").value || "T_st";
  $("which").replaceChildren(...ids.map((one) => Object.assign(element("option", measured(one.id, one.name)), { value: one.id })));
  if (ids.some((one) => one.id === chosen)) $("which").value = chosen;
  $("history").hidden = !ids.length;
  const last = values.at(-1) ?? {}, isAngle = (last.unit ?? "").startsWith("rad"), factor = isAngle ? DEGREES : 1;
  const lines = [];
  if (last.limit_high != null) lines.push({ y: last.limit_high * factor, label: say("limit") });
  if (last.limit_low != null) lines.push({ y: last.limit_low * factor, label: say("limit") });
  draw($("chart"), {
    series: [
      { kind: "line", colour: "--grid", points: values.map((one, index) => [index + 1, one.value * factor]) },
      { kind: "dots", size: 5, points: values.map((one, index) => [index + 1, one.value * factor, one.is_outside ? "--bad" : "--line"]), colour: "--line" },
    ],
    lines, x: [0.5, Math.max(values.length, 2) + 0.5],
    xLabel: say("axis_run"), yLabel: isAngle ? inDegrees(last.unit) : last.unit ?? "", xTick: (v) => (Number.isInteger(v) ? String(v) : ""), yTick: (v) => number(v, 4),
  });
  $("chart").setAttribute("aria-label", say("history_alt", { count: values.length }));
}

// ---------------------------------------------------------------- what the operator does

function showPart() {
  const serial = $("serial").value.trim(), bench = about.bench;
  if (!bench.station) { $("part").textContent = ""; return; }
  const found = bench.parts.map((one) => takes(one.serial, serial)), part = bench.parts[found.indexOf(true)];
  if (serial && serial === bench.golden) $("part").textContent = say("golden");
  else if (part) $("part").textContent = say("is_part", { part: `${part.number} ${part.revision}`, scenario: part.scenario });
  else if (serial) $("part").textContent = found.includes(null) ? "" : say("no_part");
  else $("part").textContent = bench.parts.map((one) => `${one.number} ${one.revision}`).join(", ");
}

async function start() {
  const serial = $("serial").value.trim();
  if (!serial) { $("said").textContent = say("no_serial"); $("serial").focus(); return; }
  keep("scenario", $("scenario").value);
  keep("unit", $("unit").value);
  if (await ask("start", { serial, scenario: $("scenario").value, unit: $("unit").value })) {
    $("serial").value = armed = "";
    document.activeElement.blur();
  }
}

function takeSerial(text) {
  $("serial").value = heardSerial = text;
  showPart();
  if (armed === text) { start(); return; }
  armed = text;
  $("said").textContent = say("scan_again", { serial: text });
  $("start").focus();
}

const stop = () => ask("stop");

function heard(line) {
  const text = line.trim();
  if (!about || !text) return;
  const code = text.toUpperCase().startsWith(CODE) ? text.toUpperCase().slice(CODE.length) : "";
  if (code === "STOP") stop();
  else if (code === "END") ask("end");
  else if (news.prompt && isRunning()) answerPrompt(code, text);
  else if (isRunning()) $("said").textContent = say("running_now");
  else if (!you.holds) takeBench(text);
  else if (code === "START") start();
  else if (code === "REPEAT") repeat();
  else if (!code) takeSerial(text);
}

async function takeBench(name) {
  $("operator").value = name;
  if (await ask("hold", { operator: name })) { keep("operator", name); setTimeout(() => $("serial").focus(), 300); }
}

function repeat() {
  $("serial").value = about.run.serial ?? "";
  start();
}

$("take").addEventListener("submit", (event) => { event.preventDefault(); takeBench($("operator").value.trim()); });
$("order").addEventListener("submit", (event) => { event.preventDefault(); start(); });
$("serial").addEventListener("keydown", (event) => {
  if (event.key !== "Enter") return;
  event.preventDefault();
  const text = $("serial").value;
  if (text.toUpperCase().startsWith(CODE)) $("serial").value = heardSerial;
  heard(text);
});
$("serial").addEventListener("input", showPart);
$("stop").addEventListener("click", stop);
$("end").addEventListener("click", () => ask("end"));
$("again").addEventListener("click", repeat);
$("release").addEventListener("click", () => ask("release"));
$("logout").addEventListener("click", async () => { if (await ask("logout")) location.assign("/login"); });
$("which").addEventListener("change", showHistory);
$("language").addEventListener("change", async () => { await loadWords($("language").value); showAll(); });
$("theme").addEventListener("change", () => { keep("theme", $("theme").value); showTheme(); showAll(); });
document.addEventListener("keydown", (event) => { if (event.key === "Escape" && about && isRunning()) stop(); });
addEventListener("resize", () => showAll());

function showTheme() {
  document.documentElement.dataset.theme = $("theme").value;
}

function showAll() {
  if (!about) return;
  shownPrompt = 0;
  showAbout();
  showNews();
}

// A scan without a focus goes to the field in which it belongs.
function typing(text) {
  if (!about || isRunning() || !you.holds) return false;
  $("serial").focus();
  $("serial").value = text;
  return true;
}

await loadWords();
$("language").value = language;
$("theme").value = recall("theme") ?? "auto";
$("operator").value = recall("operator") ?? "";
showTheme();
showLink();
listen(heard, typing);
connect();
