// What both pages are made of: elements, limits of measurements, and what the page's server fails at.

import { say, shown } from "./words.js";

export function element(name, text = "", classes = "") {
  const made = document.createElement(name);
  made.textContent = text;
  if (classes) made.className = classes;
  return made;
}

export function limitText({ limit_low: low, limit_high: high, unit }) {
  if (low !== null && high !== null) return `${shown(low, unit)} … ${shown(high, unit)}`;
  return low !== null ? `≥ ${shown(low, unit)}` : high !== null ? `≤ ${shown(high, unit)}` : "";
}

export function showTroubles({ troubles }) {
  const place = document.getElementById("troubles"), said = Object.entries(troubles).map(([doing, why]) => say(`trouble_${doing}`, { why }));
  place.hidden = !said.length;
  place.textContent = said.join(" ");
}
