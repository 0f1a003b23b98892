// All tests: their data, which of them the filters let through, and which one is selected. Table, charts and timelines
// are told of changes by `listen`.
const tests = (() => {
  const block = document.getElementById("all-tests");
  if (!block) { return null; }
  const data = JSON.parse(block.textContent);
  const rowOf = new Map(data.numbers.map((number, row) => [number, row]));
  const listeners = [], filters = new Map();
  const matches = new Uint8Array(data.numbers.length).fill(1);
  const found = {
    data, rowOf, matches, selected: null,
    front: new Set(data.front), drawn: new Set(data.drawn),
    listen(listener) { listeners.push(listener); },
    // Sets the filter of this name, a function of a row, or removes it.
    filter(name, permits) {
      if (permits) { filters.set(name, permits); } else { filters.delete(name); }
      const all = [...filters.values()];
      for (let row = 0; row < matches.length; row += 1) { matches[row] = all.every(permits => permits(row)) ? 1 : 0; }
      listeners.forEach(listener => listener("filter"));
    },
    select(number) {
      found.selected = number !== null && rowOf.has(number) ? number : null;
      listeners.forEach(listener => listener("selection"));
    },
    operations(row) {
      const counts = new Map();
      data.uses[row].forEach(operation => counts.set(operation, (counts.get(operation) || 0) + 1));
      const names = [...counts].sort((a, b) => a[0] - b[0])
        .map(([operation, count]) => data.operations[operation] + (count > 1 ? " ×" + count : ""));
      return names.concat((data.not_imported && data.not_imported[row]) || []).join(", ") || "without disturbance";
    },
    violates(row) { return data.violates[row].map(at => data.requirements[at].name).join(" "); },
    command(number) { return data.command[0] + "T" + number + data.command[1]; },
  };
  return found;
})();

// Dots: those of tests that a filter leaves out fade, and all of the selected test stand out.
if (tests) {
  const dots = [...document.querySelectorAll(".dot[data-test]")];
  tests.listen(() => {
    const selected = String(tests.selected);
    dots.forEach(dot => {
      const row = tests.rowOf.get(Number(dot.dataset.test));
      dot.classList.toggle("out", row !== undefined && !tests.matches[row]);
      dot.classList.toggle("selected", dot.dataset.test === selected);
    });
    document.querySelectorAll(".test").forEach(test => test.classList.toggle("selected", test.id === "T" + selected));
  });
  dots.forEach(dot => dot.addEventListener("click", () => tests.select(Number(dot.dataset.test))));
  const named = () => {
    const test = /^#T(\d+)$/.exec(location.hash);
    if (test) { tests.select(Number(test[1])); }
  };
  window.addEventListener("hashchange", named);
  // Once all parts of the script are there.
  window.addEventListener("load", named);
}
