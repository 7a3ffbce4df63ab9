// The words of the page in the language that was chosen, and numbers as that language writes them.

const kept = (() => { try { return localStorage; } catch { return { getItem: () => null, setItem() {} }; } })();

export let language = kept.getItem("language") ?? (navigator.language.startsWith("de") ? "de" : "en");
let words = {};

export const recall = (name) => kept.getItem(name);
export const keep = (name, value) => kept.setItem(name, value);

export async function loadWords(wanted = language) {
  language = wanted === "de" ? "de" : "en";
  keep("language", language);
  words = await (await fetch(`/words/${language}.json`)).json();
  document.documentElement.lang = language;
  for (const element of document.querySelectorAll("[data-w]")) element.textContent = say(element.dataset.w);
}

// Return the words of a key, with {name} replaced by what stands for it.
export function say(key, values = {}) {
  return (words[key] ?? key).replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

// Return the words of a key where there are any, else the text that was given.
export const sayOr = (key, text) => words[key] ?? text;

// Return the name of a measurement in the page's language, or the one that it was declared with.
// One of several values has the words that set it apart behind it: "step rise (large opening)" has the id
// `step_rise_large_opening`.
export function measured(id, name = id) {
  const said = words[`measurement ${id}`] ?? oneOfSeveral(id, name) ?? name;
  return said.charAt(0).toUpperCase() + said.slice(1);
}

function oneOfSeveral(id, name) {
  const apart = /\(([^()]*)\)$/.exec(name)?.[1];
  if (apart === undefined) return undefined;
  for (const suffix of [apart.replaceAll(" ", "_"), /\d+$/.exec(id)?.[0]]) {
    const kind = id.endsWith(`_${suffix}`) ? words[`measurement ${id.slice(0, -suffix.length - 1)}`] : undefined;
    if (kind !== undefined) return `${kind} (${sayOr(`value ${apart}`, apart)})`;
  }
  return undefined;
}

export function number(value, digits = 3) {
  if (value === null || value === undefined) return "–";
  const notation = value !== 0 && Math.abs(value) < 1e-3 ? "scientific" : "standard";
  return new Intl.NumberFormat(language, { maximumSignificantDigits: digits, useGrouping: false, notation }).format(value);
}

export function clock(seconds) {
  const whole = Math.max(0, Math.round(seconds));
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}`;
}

export const DEGREES = 180 / Math.PI;

// Return the unit in degrees of one in radians: ° for rad, °/s for rad/s.
export const inDegrees = (unit) => unit.replace("rad", "°");

// Return a value in SI as people read it: angles in degrees, speeds in degrees a second, small times in milliseconds.
export function shown(value, unit, digits = 3) {
  if (value === null || value === undefined) return say("unknown");
  if (unit.startsWith("rad")) return `${number(value * DEGREES, digits)} ${inDegrees(unit)}`;
  if (unit === "s" && Math.abs(value) < 1) return `${number(value * 1000, digits)} ms`;
  return `${number(value, digits)} ${unit === "1" ? "" : unit === "degC" ? "°C" : unit}`.trim();
}
