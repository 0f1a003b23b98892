// What is on the page can be taken along: pictures as SVG, tables as CSV, commands and blocks as text.
function saveAs(name, type, text) {
  const link = element("a");
  link.download = name;
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

// A file's name: the page's title, and what the part is about.
function fileName(place, ending) {
  const test = place.closest("article[id]"), section = place.closest("section");
  const heading = section && section.querySelector("h2");
  const words = [document.title, test ? test.id : heading ? heading.textContent : ""];
  return words.join(" ").replace(/[^A-Za-z0-9]+/g, "-").replace(/^-|-$/g, "").toLowerCase() + ending;
}

// Lines of cells as RFC 4180 has them.
function asCsv(lines) {
  const quoted = cell => /[",\r\n]/.test(cell) ? "\"" + cell.replace(/"/g, "\"\"") + "\"" : cell;
  return lines.map(cells => cells.map(cell => quoted(String(cell))).join(",") + "\r\n").join("");
}

function linesOf(table) {
  const words = cell => cell.textContent.replace(/\s+/g, " ").trim();
  return [...table.rows].map(row => [...row.cells].map(words));
}

// What decides how a shape or a word looks, wherever the picture is shown.
const LOOKS = ["fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray", "opacity",
  "font-family", "font-size", "font-weight", "text-anchor", "dominant-baseline", "paint-order", "vector-effect",
  "display", "visibility"];

function withLooks(from, to) {
  const style = getComputedStyle(from);
  LOOKS.forEach(name => to.setAttribute(name, style.getPropertyValue(name)));
  ["class", "style", "data-test", "tabindex"].forEach(name => to.removeAttribute(name));
  [...from.children].forEach((child, at) => withLooks(child, to.children[at]));
}

// Everything that a part of the page shows as one picture: its drawings where they are, and the words around them.
function asPicture(place) {
  const room = place.getBoundingClientRect(), paper = getComputedStyle(document.body).backgroundColor;
  const whole = part("svg", { width: room.width, height: room.height, viewBox: "0 0 " + room.width + " " + room.height });
  whole.append(part("rect", { width: "100%", height: "100%", fill: paper }));
  const isDrawing = it => it.localName === "svg" && !it.parentNode.closest("svg");
  [place, ...place.querySelectorAll("svg")].filter(isDrawing).forEach(drawing => {
    const box = drawing.getBoundingClientRect(), copy = drawing.cloneNode(true);
    withLooks(drawing, copy);
    const frame = { x: box.left - room.left, y: box.top - room.top, width: box.width, height: box.height, overflow: "visible" };
    Object.keys(frame).forEach(key => copy.setAttribute(key, frame[key]));
    whole.append(copy);
  });
  const walker = document.createTreeWalker(place, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const around = node.parentElement;
    if (!node.data.trim() || around.closest("svg")) { continue; }
    const range = document.createRange();
    range.selectNodeContents(node);
    const box = range.getBoundingClientRect(), style = getComputedStyle(around);
    if (!box.width) { continue; }
    whole.append(part("text", {
      x: box.left - room.left, y: box.bottom - room.top - 0.22 * box.height, fill: style.color,
      "font-family": style.fontFamily, "font-size": style.fontSize, "font-weight": style.fontWeight,
    }, node.data.trim()));
  }
  return new XMLSerializer().serializeToString(whole);
}

// The clipboard is closed to some pages that are opened from a file; selected text can be copied there.
async function copy(place, pressed) {
  const words = pressed.textContent;
  let done = true;
  try { await navigator.clipboard.writeText(place.textContent); } catch {
    getSelection().selectAllChildren(place);
    done = document.execCommand("copy");
  }
  pressed.textContent = done ? "Copied" : "Selected: copy it with the keyboard";
  setTimeout(() => { pressed.textContent = words; }, 2000);
}

function saving(place, words, label, pressed) {
  const bar = element("p", "save"), made = button(words, label, () => pressed(made));
  bar.append(made);
  place.after(bar);
}

function savingCsv(place, lines) {
  saving(place, "Save as CSV", "", () => saveAs(fileName(place, ".csv"), "text/csv", asCsv(lines())));
}

window.addEventListener("load", () => {
  document.querySelectorAll("main table:not(.tests)").forEach(table => savingCsv(table.closest(".scroll") || table, () => linesOf(table)));
  const drawings = [...document.querySelectorAll("main svg[role=img]")].map(it => it.closest(".chart, figure") || it);
  [...new Set(drawings)].filter(it => !it.closest("table")).forEach(place => {
    const after = place.closest(".scroll") || place;
    saving(after, "Save as SVG", "", () => saveAs(fileName(place, ".svg"), "image/svg+xml", asPicture(place)));
  });
  document.querySelectorAll("main pre").forEach(place => saving(place, "Copy", "", pressed => copy(place, pressed)));
  document.querySelectorAll("main .command code").forEach(place => {
    const made = button("Copy", "Copy the command", () => copy(place, made));
    place.after(" ", made);
  });
});
