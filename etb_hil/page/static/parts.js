// What both pages are made of: elements, limits of measurements, patterns of serial numbers, and what the page's server fails at.

import { say, shown } from "./words.js";

export function element(name, text = "", classes = "") {
  const made = document.createElement(name);
  made.textContent = text;
  if (classes) made.className = classes;
  return made;
}

export const isKnown = ({ value, high }) => value !== null || high !== null;

// Return the limit that a measurement is beyond or too close to. A bound that keeps the upper limit may be below the lower.
export function passedLimit({ value, high, limit_low: low, limit_high: top }) {
  if (low === null || top === null) return low ?? top;
  return (value === null ? high >= top : value > low) ? top : low;
}

// Return what was measured: without a value, a bound of it.
export const valueText = ({ value, high, unit }) => (value === null && high !== null ? `≤ ${shown(high, unit)}` : shown(value, unit));

export function limitText({ limit_low: low, limit_high: high, unit }) {
  if (low !== null && high !== null) return `${shown(low, unit)} … ${shown(high, unit)}`;
  return low !== null ? `≥ ${shown(low, unit)}` : high !== null ? `≤ ${shown(high, unit)}` : "";
}

// Return whether a part's pattern of serial numbers takes one: null where only the server knows.
// The pattern is Python's. With the flag u, JavaScript refuses what it would read in another way; an escaped sign is
// written as its code, because it would refuse that, too. Letters and digits of other scripts are Python's to judge.
export function takes(pattern, serial) {
  if (!/^[ -~]*$/.test(serial)) return null;
  const same = pattern.replace(/\\([^A-Za-z0-9])/gu, (_, sign) => `\\u{${sign.codePointAt(0).toString(16)}}`);
  try {
    return new RegExp(`^(?:${same})$`, "u").test(serial);
  } catch {
    return null;
  }
}

export function showTroubles({ troubles }) {
  const place = document.getElementById("troubles"), said = Object.entries(troubles).map(([doing, why]) => say(`trouble_${doing}`, { why }));
  place.hidden = !said.length;
  place.textContent = said.join(" ");
}
