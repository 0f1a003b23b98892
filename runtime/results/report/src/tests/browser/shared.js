// Leaves what a function finds in the document, or the error that stopped it.
function leave(find) {
  const found = document.createElement("pre");
  found.id = "findings";
  try { found.textContent = JSON.stringify(find()); } catch (error) {
    console.error(error.stack);
    found.textContent = JSON.stringify({ error: String(error) });
  }
  document.body.append(found);
}
const one = selector => document.querySelector(selector);
const all = selector => [...document.querySelectorAll(selector)];
// Chooses an option of the list that has this label.
function choose(room, label, option) {
  const field = [...room.querySelectorAll("label")].find(it => it.textContent.startsWith(label)).querySelector("select");
  field.value = [...field.options].findIndex(it => it.text === option);
  field.dispatchEvent(new Event("change"));
}
