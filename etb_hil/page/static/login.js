import { loadWords, say } from "./words.js";

const form = document.getElementById("login");
const said = document.getElementById("said");

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  const password = document.getElementById("password").value;
  const answer = await fetch("/api/login", { method: "POST", body: JSON.stringify({ password }) });
  if (answer.ok) location.assign("/");
  else said.textContent = say((await answer.json().catch(() => ({}))).why ?? "too_many");
});

await loadWords();
