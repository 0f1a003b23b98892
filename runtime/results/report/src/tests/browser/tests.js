// The table of all tests, and what is linked with it.
leave(() => {
  const checks = {}, room = one("#tests"), view = one(".viewport");
  const data = JSON.parse(one("#all-tests").textContent);
  const said = () => one("#table-of-tests output").textContent;
  const rows = () => all(".tests tbody tr:not(.space)");
  const column = n => rows().map(row => row.children[n].textContent);
  const titles = all(".tests thead button").map(title => title.textContent);
  const number = data.numbers.length;
  checks["it has all tests"] = said() === number + " tests";
  checks["few rows are in the document"] = rows().length < number && rows().length >= 15;
  checks["a space stands for the others"] = view.scrollHeight >= number * 30;

  const metric = data.metrics[0], at = titles.findIndex(title => title.startsWith(metric.name));
  all(".tests thead button")[at].click();
  const sorted = column(at).map(Number);
  checks["a click sorts, the largest first"] = sorted.length > 3 && sorted.every((value, n) => n === 0 || value <= sorted[n - 1]);
  checks["and says so"] = all(".tests thead th")[at].getAttribute("aria-sort") === "descending";
  all(".tests thead button")[at].click();
  const risen = column(at).map(Number);
  checks["another click turns it round"] = risen.every((value, n) => n === 0 || value >= risen[n - 1]);
  const largest = Math.max(...metric.values.filter(value => value !== null));
  checks["missing values come last"] = !column(at).includes("–") || Number(sorted[0]) >= largest - 1;
  all(".tests thead button")[0].click();

  const requirement = data.requirements.findIndex((it, n) => data.violates.some(violated => violated.includes(n)));
  const violating = data.violates.filter(violated => violated.includes(requirement)).length;
  choose(room, "violates", data.requirements[requirement].name);
  checks["a requirement is a filter"] = said() === violating + " of " + number + " tests";
  checks["dots of other tests fade"] = all(".dot.out").length > 0 && all(".dot:not(.out)").length > 0;
  const faded = all(".dot.out").every(dot => !data.violates[data.numbers.indexOf(Number(dot.dataset.test))].includes(requirement));
  checks["and only those"] = faded;
  choose(room, "operation", data.operations[0]);
  const both = data.violates.filter((violated, row) => violated.includes(requirement) && data.uses[row].includes(0)).length;
  checks["filters add up"] = said() === both + " of " + number + " tests";
  checks["the number of rows follows"] = one("table.tests").getAttribute("aria-rowcount") === String(both + 1);
  choose(room, "violates", "all tests");
  choose(room, "operation", "any");
  choose(room, "outcome", "crash");
  const crashes = data.outcome.filter(outcome => data.outcomes[outcome] === "crash").length;
  checks["an outcome is a filter"] = crashes > 0 && said() === crashes + " of " + number + " tests";
  choose(room, "outcome", "any");
  checks["and can be removed"] = said() === number + " tests" && all(".dot.out").length === 0;

  const drawn = data.front[0];
  const dot = all(".dot").find(it => it.dataset.test === String(drawn));
  dot.dispatchEvent(new MouseEvent("click", { bubbles: true }));
  const current = one(".tests [aria-current]");
  checks["a dot selects its row"] = current.children[0].textContent === "T" + drawn;
  checks["and all its dots"] = all(".dot.selected").length >= 2 && all(".dot.selected").every(it => it.dataset.test === String(drawn));
  checks["and its timeline"] = one("#T" + drawn).classList.contains("selected");
  checks["and says how to see more"] = one("p.selected").textContent.includes("sesamec show kuka_cell.sesame T" + drawn + " ");
  view.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowDown" }));
  checks["keys move the selection"] = one(".tests [aria-current]").children[0].textContent === "T" + (drawn + 1);
  checks["the selected row is in view"] = (() => {
    const box = one(".tests [aria-current]").getBoundingClientRect(), frame = view.getBoundingClientRect();
    return box.top >= frame.top && box.bottom <= frame.bottom + 1;
  })();

  // A range of an axis is a filter too.
  const controls = one("#parallel-coordinates .controls"), [low, high] = controls.querySelectorAll("input");
  const values = metric.values.filter(value => value !== null), middle = values.slice().sort((a, b) => a - b)[Math.floor(values.length / 2)];
  choose(controls, "range of", metric.name);
  low.value = middle;
  low.dispatchEvent(new Event("change"));
  const above = values.filter(value => value >= middle).length;
  checks["a range of an axis filters"] = said() === above + " of " + number + " tests";
  const most = Math.max(...values);
  high.value = middle; low.value = most;
  low.dispatchEvent(new Event("change"));
  checks["whichever end is written first"] = said() === above + " of " + number + " tests";
  const canvas = one("#parallel-coordinates canvas");
  canvas.dispatchEvent(new PointerEvent("pointerdown", { button: 2 }));
  canvas.dispatchEvent(new PointerEvent("pointerup", { button: 2 }));
  checks["other buttons of the mouse leave it"] = said() === above + " of " + number + " tests";
  controls.querySelector("button").click();
  checks["until it is removed"] = said() === number + " tests" && low.value === "" && high.value === "";
  return { checks, titles, said: said() };
});
