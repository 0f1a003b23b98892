// The page is complete without its script, but for the table of all tests. This part makes elements, and shows the
// tooltip of a mark without delay. Marks that stand for a test say so in `data-test`.
const tip = document.getElementById("tip");
// If anything can be redrawn, the page already contains a picture, whose namespace is reused.
const NAMESPACE = (document.querySelector("svg") || {}).namespaceURI;

function element(name, className, words) {
  const made = document.createElement(name);
  if (className) { made.className = className; }
  if (words !== undefined) { made.textContent = words; }
  return made;
}

function part(name, attributes, words) {
  const made = document.createElementNS(NAMESPACE, name);
  Object.keys(attributes).forEach(key => made.setAttribute(key, attributes[key]));
  if (words !== undefined) { made.textContent = words; }
  return made;
}

function control(bar, words, field) {
  const label = element("label");
  label.append(words, field);
  bar.append(label);
  return field;
}

function choice(bar, words, names, chosen, changed) {
  const field = element("select");
  names.forEach((name, n) => field.add(new Option(name, n, n === chosen, n === chosen)));
  field.addEventListener("change", changed);
  return control(bar, words, field);
}

function button(words, label, pressed) {
  const made = element("button", "", words);
  made.type = "button";
  if (label) { made.setAttribute("aria-label", label); }
  made.addEventListener("click", pressed);
  return made;
}

function barBefore(place) {
  const made = element("div", "controls");
  place.parentNode.insertBefore(made, place);
  return made;
}

function hint(mark, words) {
  mark.setAttribute("aria-label", words);
  mark.addEventListener("pointerenter", () => { tip.textContent = words; tip.hidden = false; });
  mark.addEventListener("pointermove", event => {
    const left = Math.min(event.clientX + 14, window.innerWidth - tip.offsetWidth - 8);
    tip.style.left = Math.max(8, left) + "px";
    tip.style.top = event.clientY + 16 + "px";
  });
  mark.addEventListener("pointerleave", () => { tip.hidden = true; });
}

document.querySelectorAll("svg title").forEach(title => {
  const mark = title.parentNode, words = title.textContent;
  title.remove();
  hint(mark, words);
  const test = /^T(\d+)[ :]/.exec(words) || (/^reference run/.test(words) ? ["", "0"] : null);
  if (test && mark.matches(".dot")) { mark.dataset.test = test[1]; }
});

// Enough digits for people, as in the rest of the page: four of the largest value, and the smallest is not shown as
// zero; no more than make a difference.
function decimalsOf(values) {
  const known = values.filter(value => value !== null).map(Math.abs);
  let largest = 0, smallest = Infinity;
  known.forEach(value => {
    largest = Math.max(largest, value);
    if (value > 0) { smallest = Math.min(smallest, value); }
  });
  const magnitude = value => Math.floor(Math.log10(value));
  const wanted = Math.max(3 - magnitude(largest), -magnitude(smallest));
  const told = scale => known.every(value => Math.abs(Math.round(value * scale) - value * scale) < 1e-6);
  const decimals = [0, 1, 2].find(decimals => wanted <= decimals || told(Math.pow(10, decimals)));
  return decimals === undefined ? 3 : decimals;
}

// What is too large or small to be read with so many decimals gets an exponent; a zero has no sign.
function fixed(value, decimals) {
  const size = Math.abs(value);
  if (value !== 0 && !(size >= 5e-4 && size < 1e9)) { return value.toExponential(2).replace("e+", "e"); }
  const text = value.toFixed(decimals);
  return /^-[0.]*$/.test(text) ? text.slice(1) : text;
}

function withUnit(value, decimals, unit) {
  return fixed(value, decimals) + (unit ? " " + unit : "");
}

// Round numbers between two ends, about so many.
function ticksBetween(low, high, count) {
  const raw = (high - low) / count, power = Math.pow(10, Math.floor(Math.log10(raw)));
  const step = power * [1, 2, 5, 10].find(times => times * power >= raw * (1 - 1e-9));
  const ticks = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n += 1) { ticks.push(n * step); }
  return { ticks, decimals: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}
