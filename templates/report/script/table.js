// The table of all tests: sorted by any column, filtered, with rows made as they come into view.
if (tests) {
  const ROW = 30, BEYOND = 12;
  const { data } = tests, place = document.getElementById("table-of-tests"), count = data.numbers.length;
  const numbers = (title, values, unit) => {
    const decimals = decimalsOf(values);
    return {
      title: title + (unit ? " [" + unit + "]" : ""), number: true, value: row => values[row],
      text: row => values[row] === null ? "–" : fixed(values[row], decimals),
    };
  };
  const words = (title, text) => ({ title, value: text, text });
  const columns = [
    { title: "test", value: row => data.numbers[row], text: row => "T" + data.numbers[row] },
    numbers("generation", data.generations),
    words("outcome", row => data.outcomes[data.outcome[row]]),
    ...data.metrics.map(metric => numbers(metric.name, metric.values, metric.unit)),
    {
      title: "violates", bad: true, text: tests.violates,
      value: row => data.violates[row].length ? [data.violates[row].length, tests.violates(row)] : null,
    },
    words("operations", tests.operations),
  ].filter((column, at) => at !== 1 || data.generations.some(generation => generation !== null));
  let order = [], sorted = 0, descending = false;

  const controls = element("div", "controls"), said = element("output");
  const anyOf = (label, names, filter) => {
    const field = choice(controls, label, names, 0, () => tests.filter(label, field.value === "0" ? null : filter(Number(field.value) - 1)));
    return field;
  };
  const fields = [
    data.requirements.length && anyOf("violates", ["all tests", "any requirement", "no requirement"].concat(data.requirements.map(it => it.name)),
      at => row => at === 0 ? data.violates[row].length > 0 : at === 1 ? !data.violates[row].length : data.violates[row].includes(at - 2)),
    data.operations.length && anyOf("operation", ["any"].concat(data.operations), at => row => data.uses[row].includes(at)),
    data.outcomes.length > 1 && anyOf("outcome", ["any"].concat(data.outcomes), at => row => data.outcome[row] === at),
  ].filter(field => field);
  if (data.front.length) {
    const box = element("input");
    box.type = "checkbox";
    box.addEventListener("change", () => tests.filter("front", box.checked ? row => tests.front.has(data.numbers[row]) : null));
    control(controls, "on the front", box);
  }
  controls.append(said);

  const about = element("p", "selected"), view = element("div", "viewport"), table = element("table", "tests");
  const head = element("thead"), body = element("tbody"), titles = element("tr");
  about.setAttribute("role", "status");
  view.tabIndex = 0;
  view.setAttribute("role", "region");
  view.setAttribute("aria-label", "all tests; arrow keys move the selection");
  columns.forEach((column, at) => {
    const title = element("th", column.number ? "number" : "words");
    title.scope = "col";
    title.append(button(column.title, "", () => {
      descending = sorted === at ? !descending : Boolean(column.number || column.bad);
      sorted = at;
      arrange();
    }));
    titles.append(title);
  });
  head.append(titles);
  table.append(head, body);
  view.append(table);
  place.append(controls, view, about);
  // Those that the filters let through, in the order of the table, with all digits.
  savingCsv(view, () => [columns.map(column => column.title)].concat(order.map(row => columns.map(column => {
    const value = column.number ? column.value(row) : column.text(row);
    return value === null ? "" : value;
  }))));

  // Missing values come last, whichever way the table is sorted; equal ones stay in the order of tests.
  function arrange() {
    const { value } = columns[sorted], keys = [];
    order = [];
    for (let row = 0; row < count; row += 1) {
      if (tests.matches[row]) { order.push(row); }
      keys.push(value(row));
    }
    const compare = (a, b) => Array.isArray(a) ? a[0] - b[0] || compare(a[1], b[1]) : a < b ? -1 : a > b ? 1 : 0;
    order.sort((a, b) => {
      if (keys[a] === null || keys[b] === null) { return (keys[a] === null) - (keys[b] === null) || a - b; }
      return (descending ? compare(keys[b], keys[a]) : compare(keys[a], keys[b])) || a - b;
    });
    [...titles.children].forEach((title, at) => {
      title.setAttribute("aria-sort", at !== sorted ? "none" : descending ? "descending" : "ascending");
    });
    said.textContent = order.length === count ? count + " tests" : order.length + " of " + count + " tests";
    table.setAttribute("aria-rowcount", order.length + 1);
    show();
  }
  const space = height => {
    const row = element("tr", "space");
    row.setAttribute("aria-hidden", "true");
    const cell = element("td");
    cell.colSpan = columns.length;
    cell.style.height = height + "px";
    row.append(cell);
    return row;
  };
  function show() {
    const first = Math.max(0, Math.floor(view.scrollTop / ROW) - BEYOND);
    const last = Math.min(order.length, first + Math.ceil((view.clientHeight || 480) / ROW) + 2 * BEYOND);
    const rows = [];
    if (first > 0) { rows.push(space(first * ROW)); }
    for (let at = first; at < last; at += 1) { rows.push(rowAt(at)); }
    if (last < order.length) { rows.push(space((order.length - last) * ROW)); }
    const focused = body.contains(document.activeElement);
    body.replaceChildren(...rows);
    if (focused) {
      const current = body.querySelector("[aria-current] button");
      (current || view).focus({ preventScroll: true });
    }
  }
  function rowAt(at) {
    const row = order[at], number = data.numbers[row], made = element("tr");
    made.setAttribute("aria-rowindex", at + 2);
    if (number === tests.selected) { made.setAttribute("aria-current", "true"); }
    columns.forEach((column, n) => {
      const text = column.text(row);
      if (n === 0) {
        const cell = element("th"), name = button(text, "", () => {});
        cell.scope = "row";
        name.tabIndex = -1;
        if (tests.front.has(number)) { cell.className = "on-front"; name.title = "on the front"; }
        cell.append(name);
        made.append(cell);
      } else {
        made.append(element("td", (column.number ? "number" : "words") + (column.bad && text ? " bad" : ""), text));
      }
    });
    made.addEventListener("click", () => tests.select(number));
    return made;
  }
  function describe() {
    about.replaceChildren();
    if (tests.selected === null) { return; }
    const row = tests.rowOf.get(tests.selected), name = "T" + tests.selected;
    about.append(element("b", "", name), " " + tests.operations(row) + ". ");
    if (tests.drawn.has(tests.selected)) {
      const link = element("a", "", "See it over time");
      link.href = "#" + name;
      about.append(link, ". ");
    }
    about.append("In a terminal: ", element("code", "", tests.command(tests.selected)));
  }
  view.addEventListener("scroll", show);
  view.addEventListener("keydown", event => {
    const step = { ArrowDown: 1, ArrowUp: -1, PageDown: 10, PageUp: -10 }[event.key];
    if (!step || !order.length) { return; }
    event.preventDefault();
    const now = order.indexOf(tests.rowOf.get(tests.selected));
    tests.select(data.numbers[order[Math.min(order.length - 1, Math.max(0, now < 0 ? 0 : now + step))]]);
  });
  tests.listen(change => {
    if (change === "filter") { arrange(); return; }
    describe();
    const at = order.indexOf(tests.rowOf.get(tests.selected));
    if (at >= 0) {
      const top = at * ROW, room = view.clientHeight - head.offsetHeight;
      if (top < view.scrollTop || top + ROW > view.scrollTop + room) { view.scrollTop = Math.max(0, top - room / 2); }
    }
    show();
  });
  arrange();
}
