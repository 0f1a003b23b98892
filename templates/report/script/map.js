// The map of cells: other dimensions, side by side, coloured by tests or by the worst value of a metric.
document.querySelectorAll(".map").forEach(function (room) {
  var all = JSON.parse(room.dataset.cells), axes = all.axes, drawn = new Set(all.drawn);
  if (axes.length < 2) { return; }
  var feasible = [], hits = new Map(), total = 1;
  axes.forEach(function (axis) { total *= axis.cells; });
  all.reach.forEach(function (length, n) { for (var i = 0; i < length; i += 1) { feasible.push(n % 2 === 1); } });
  all.hit.forEach(function (row) { hits.set(row[0], row); });

  var controls = document.createElement("div");
  controls.className = "controls";
  function chosen(words, names, at) { return choice(controls, words, names, at, show); }
  var names = axes.map(function (axis) { return axis.name; });
  var across = chosen("across", names, 0), up = chosen("up", names, 1);
  var third = axes.length > 2 ? chosen("for each", ["all"].concat(names), 0) : null;
  var colours = ["tests"].concat(all.metrics.map(function (metric) { return "worst " + metric.name; }));
  var colour = chosen("colour", colours, 0);

  function edge(axis, at) { return String(Number((axis.low + (axis.high - axis.low) * at / axis.cells).toPrecision(3))); }
  function span(axis, at) { return axis.name + " " + edge(axis, at) + " to " + edge(axis, at + 1); }
  function places(x, y, z, slice) {
    var found = [];
    for (var cell = 0; cell < total; cell += 1) {
      var rest = cell, at = [];
      for (var k = axes.length - 1; k >= 0; k -= 1) { at[k] = rest % axes[k].cells; rest = Math.floor(rest / axes[k].cells); }
      if (z !== null && at[z] !== slice) { continue; }
      var n = at[y] * axes[x].cells + at[x];
      var place = found[n] || (found[n] = { column: at[x], row: at[y], cells: 0, covered: 0, feasible: 0, hits: 0, worst: [] });
      place.cells += 1;
      place.feasible += feasible[cell] ? 1 : 0;
      var row = hits.get(cell);
      if (!row) { continue; }
      place.hits += row[1];
      place.covered += row[1] >= all.needed ? 1 : 0;
      all.metrics.forEach(function (metric, m) {
        var value = row[2 + 2 * m], known = place.worst[m];
        if (value !== null && (!known || (metric.most ? value > known[0] : value < known[0]))) {
          place.worst[m] = [value, row[3 + 2 * m]];
        }
      });
    }
    return found;
  }
  function words(place, x, y, z, slice) {
    var text = span(axes[x], place.column) + ", " + span(axes[y], place.row);
    if (z !== null) { text += ", " + span(axes[z], slice); }
    if (!place.feasible) { return text + ": no test can get there"; }
    text += ": " + place.hits + (place.hits === 1 ? " test" : " tests");
    if (place.cells > 1) { text += ", " + place.covered + " of " + place.cells + " cells covered"; }
    all.metrics.forEach(function (metric, m) {
      var worst = place.worst[m];
      if (worst) { text += ", " + metric.name + " " + worst[0] + (metric.unit ? " " + metric.unit : "") + " in T" + worst[1]; }
    });
    return text;
  }
  function picture(found, x, y, z, slice, m, low, high) {
    var columns = axes[x].cells, rows = axes[y].cells;
    var chart = document.createElement("div"), above = document.createElement("p"), below = document.createElement("p");
    chart.className = "chart small"; above.className = "axis-title"; below.className = "axis-title below";
    above.textContent = z === null ? names[y] : names[y] + " · " + span(axes[z], slice); below.textContent = names[x];
    var svg = part("svg", { "class": "scatter", role: "img", "aria-label": "cells of " + names[x] + " and " + names[y] });
    found.forEach(function (place) {
      var empty = !place.hits || (m >= 0 && !place.worst[m]);
      var look = !place.feasible ? "cell infeasible" : empty ? "cell empty" : m < 0 ? "cell" : "cell worst";
      var cell = part("rect", {
        "class": look, x: 100 * place.column / columns + "%", y: 100 * (rows - 1 - place.row) / rows + "%",
        width: 100 / columns + "%", height: 100 / rows + "%"
      });
      if (!empty && place.feasible) {
        var share = m < 0 ? Math.sqrt(place.hits / high) : high === low ? 1 : (place.worst[m][0] - low) / (high - low);
        if (m >= 0 && !all.metrics[m].most && high !== low) { share = 1 - share; }
        cell.setAttribute("fill-opacity", 0.15 + 0.85 * share);
      }
      var said = words(place, x, y, z, slice), worst = place.worst[Math.max(m, 0)];
      if (worst && drawn.has(worst[1])) {
        cell.classList.add("to");
        said += "; click to see T" + worst[1];
        cell.addEventListener("click", function () { tip.hidden = true; location.hash = "T" + worst[1]; });
      }
      hint(cell, said);
      svg.append(cell);
    });
    [[x, columns], [y, rows]].forEach(function (side, vertical) {
      var every = Math.ceil(side[1] / (z === null ? 6 : 2));
      for (var at = 0; at <= side[1]; at += every) {
        var place = vertical ? { "class": "tick end", x: "-8", y: 100 - 100 * at / side[1] + "%", dy: "4" }
          : { "class": "tick middle", x: 100 * at / side[1] + "%", y: "100%", dy: "18" };
        svg.append(part("text", place, edge(axes[side[0]], at)));
      }
    });
    chart.append(above, svg, below);
    return chart;
  }
  function show() {
    var x = Number(across.value), y = Number(up.value), m = Number(colour.value) - 1;
    if (x === y) { y = x === 0 ? 1 : 0; up.value = y; }
    var z = third && Number(third.value) > 0 ? Number(third.value) - 1 : null;
    if (z === x || z === y) { z = null; third.value = 0; }
    var slices = [], count = z === null ? 1 : axes[z].cells;
    if (axes[x].cells * axes[y].cells * count > 10000) {
      room.replaceChildren(controls, "More than 10,000 cells: too many to show.");
      return;
    }
    for (var slice = 0; slice < count; slice += 1) { slices.push(places(x, y, z, slice)); }
    var values = [];
    slices.forEach(function (found) {
      found.forEach(function (place) {
        if (m < 0) { values.push(place.hits); } else if (place.worst[m]) { values.push(place.worst[m][0]); }
      });
    });
    var low = Math.min.apply(null, values), high = Math.max.apply(null, values.concat(m < 0 ? [1] : []));
    var field = document.createElement("div");
    field.className = z === null ? "" : "slices";
    room.classList.toggle("spread", z !== null);
    slices.forEach(function (found, slice) { field.append(picture(found, x, y, z, slice, m, low, high)); });
    var scale = document.createElement("p");
    scale.className = "quiet";
    scale.textContent = m < 0 ? "Strongest: " + high + (high === 1 ? " test." : " tests.") : !values.length ? "No values."
      : "Strongest: " + (all.metrics[m].most ? high : low) + ", weakest: " + (all.metrics[m].most ? low : high)
        + (all.metrics[m].unit ? " " + all.metrics[m].unit : "") + ".";
    room.replaceChildren(controls, field, scale);
  }
  show();
});
