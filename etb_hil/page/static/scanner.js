// A scanner types what it reads and ends it with Enter, wherever the focus is.

const LONGEST_PAUSE_MS = 2000;
export const CODE = "ETBHIL-"; // what the codes of the command sheet begin with

// Call heard(text) for each line that is typed outside of the fields; typing(text) may take in what is typed so far: it returns true.
export function listen(heard, typing) {
  let text = "", at = 0;
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const target = event.target;
    if (target.matches("input, select, textarea")) return;
    if (event.timeStamp - at > LONGEST_PAUSE_MS) text = "";
    if (event.key === "Enter") {
      if (!text) return;
      event.preventDefault();
      const line = text;
      text = "";
      heard(line);
    } else if (event.key.length === 1 && !(event.key === " " && !text)) {
      at = event.timeStamp;
      event.preventDefault();
      text = typing(text + event.key) ? "" : text + event.key;
    }
  });
}
