// Parallel coordinates: an axis for each objective, bounded metric and dimension of the reduced space, a line for each
// test. Ranges on the axes are filters of all tests.
if (tests) {
  const { data } = tests, HEIGHT = 220, TOP = 8;
  const axes = data.metrics.filter(metric => metric.objective || metric.bounded).concat(data.points).map(column => {
    let low = Infinity, high = -Infinity;
    column.values.forEach(value => {
      if (value !== null) { low = Math.min(low, value); high = Math.max(high, value); }
    });
    return { name: column.name, unit: column.unit, values: column.values, low, high, range: null };
  }).filter(axis => axis.high > axis.low);
  if (axes.length > 1) {
    const place = document.getElementById("parallel-coordinates");
    const controls = element("div", "controls"), scroll = element("div", "scroll"), field = element("div", "parallel");
    const canvas = element("canvas"), pen = canvas.getContext("2d");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "parallel coordinates: " + axes.map(axis => axis.name).join(", ") + "; a line for each test");
    const on = (axis, value) => TOP + HEIGHT * (1 - (value - axis.low) / (axis.high - axis.low));
    const at = (axis, y) => axis.low + (axis.high - axis.low) * Math.min(1, Math.max(0, 1 - (y - TOP) / HEIGHT));
    let width = 0, drag = null, planned = false;
    const left = n => 44 + (width - 88) * n / (axes.length - 1);

    const which = choice(controls, "range of", axes.map(axis => axis.name), 0, showRange);
    const ends = ["from", "to"].map(words => {
      const end = element("input");
      end.type = "number"; end.step = "any";
      end.addEventListener("change", () => {
        const axis = axes[which.value], [low, high] = ends.map(end => end.value === "" ? null : Number(end.value));
        const range = [low === null ? axis.low : low, high === null ? axis.high : high].sort((a, b) => a - b);
        permit(axis, low === null && high === null ? null : range);
      });
      return control(controls, words, end);
    });
    controls.append(button("Remove all ranges", "", () => {
      axes.forEach(axis => { axis.range = null; });
      axes.forEach(axis => tests.filter("range " + axis.name, null));
      showRange();
    }));
    function showRange() {
      const { range, low, high } = axes[which.value];
      ends.forEach((end, n) => {
        end.value = range ? Number(range[n].toPrecision(4)) : "";
        end.placeholder = Number([low, high][n].toPrecision(4));
      });
    }
    function permit(axis, range) {
      axis.range = range;
      which.value = axes.indexOf(axis);
      showRange();
      tests.filter("range " + axis.name, range && (row => {
        const value = axis.values[row];
        return value !== null && range[0] <= value && value <= range[1];
      }));
    }
    axes.forEach(axis => {
      const decimals = decimalsOf([axis.low, axis.high]);
      // The name may take two lines, and breaks between its words.
      axis.labels = [element("div", "axis-name", (axis.name + (axis.unit ? " [" + axis.unit + "]" : "")).replace(/_/g, "_\u200b"))].concat(
        [axis.high, axis.low].map(value => element("div", "axis-end", fixed(value, decimals))));
      axis.labels[0].title = axis.name;
      field.append(...axis.labels);
    });
    field.append(canvas);
    scroll.append(field);
    place.append(element("h3", "", "Parallel coordinates"), controls, scroll,
      element("p", "quiet", "Each line is a test; red lines violate a requirement. Drag along an axis to see the tests in a range only; click an axis to "
        + "remove its range and select the nearest test."));

    function draw() {
      planned = false;
      width = Math.max(field.clientWidth, 84 * axes.length);
      const ratio = window.devicePixelRatio || 1, style = getComputedStyle(document.documentElement);
      const colour = name => style.getPropertyValue(name).trim();
      canvas.width = width * ratio; canvas.height = (HEIGHT + 2 * TOP) * ratio;
      canvas.style.width = width + "px"; canvas.style.height = HEIGHT + 2 * TOP + "px";
      pen.setTransform(ratio, 0, 0, ratio, 0, 0);
      axes.forEach((axis, n) => {
        const [name, high, low] = axis.labels;
        [name, high, low].forEach(label => { label.style.left = left(n) + "px"; });
        name.style.width = (width - 88) / (axes.length - 1) - 8 + "px";
      });
      const lines = [[], [], []];
      data.numbers.forEach((number, row) => lines[!tests.matches[row] ? 0 : data.violates[row].length ? 2 : 1].push(row));
      const opacity = Math.min(0.75, Math.max(0.06, 40 / Math.max(1, lines[1].length + lines[2].length)));
      stroke(lines[0], colour("--rule"), 1, lines[0].length > 2000 ? 0.35 : 0.8);
      stroke(lines[1], colour("--accent"), 1, opacity);
      stroke(lines[2], colour("--bad"), 1, opacity);
      if (tests.selected !== null) { stroke([tests.rowOf.get(tests.selected)], colour("--ink"), 2.5, 1); }
      pen.globalAlpha = 1;
      axes.forEach((axis, n) => {
        pen.strokeStyle = colour("--quiet"); pen.lineWidth = 1;
        pen.beginPath(); pen.moveTo(left(n), TOP); pen.lineTo(left(n), TOP + HEIGHT); pen.stroke();
        if (!axis.range) { return; }
        const [bottom, top] = axis.range.map(value => on(axis, Math.min(axis.high, Math.max(axis.low, value))));
        pen.globalAlpha = 0.25; pen.fillStyle = colour("--accent"); pen.fillRect(left(n) - 7, top, 14, bottom - top);
        pen.globalAlpha = 1; pen.strokeStyle = colour("--accent"); pen.strokeRect(left(n) - 7, top, 14, bottom - top);
      });
    }
    // A line is broken where a test has no value.
    function stroke(rows, colour, thick, opacity) {
      pen.strokeStyle = colour; pen.lineWidth = thick; pen.globalAlpha = opacity;
      rows.forEach(row => {
        let going = false;
        pen.beginPath();
        axes.forEach((axis, n) => {
          const value = axis.values[row];
          if (value === null) { going = false; return; }
          if (going) { pen.lineTo(left(n), on(axis, value)); } else { pen.moveTo(left(n), on(axis, value)); }
          going = true;
        });
        pen.stroke();
      });
    }
    const plan = () => { if (!planned) { planned = true; requestAnimationFrame(draw); } };
    canvas.addEventListener("pointerdown", event => {
      if (event.button !== 0) { return; }
      const n = Math.round((event.offsetX - 44) / (width - 88) * (axes.length - 1));
      const axis = axes[Math.min(axes.length - 1, Math.max(0, n))];
      drag = { axis, from: event.offsetY, before: axis.range };
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointermove", event => {
      if (!drag || Math.abs(event.offsetY - drag.from) < 4) { return; }
      drag.axis.range = [at(drag.axis, Math.max(drag.from, event.offsetY)), at(drag.axis, Math.min(drag.from, event.offsetY))];
      plan();
    });
    canvas.addEventListener("pointerup", event => {
      if (!drag) { return; }
      const { axis, from } = drag;
      drag = null;
      if (Math.abs(event.offsetY - from) >= 4) { permit(axis, axis.range); return; }
      permit(axis, null);
      const value = at(axis, event.offsetY);
      let nearest = null;
      data.numbers.forEach((number, row) => {
        if (!tests.matches[row] || axis.values[row] === null) { return; }
        const apart = Math.abs(axis.values[row] - value);
        if (!nearest || apart < nearest[0]) { nearest = [apart, number]; }
      });
      if (nearest) { tests.select(nearest[1]); }
    });
    canvas.addEventListener("pointercancel", () => {
      if (drag) { drag.axis.range = drag.before; }
      drag = null;
      plan();
    });
    tests.listen(plan);
    window.addEventListener("resize", plan);
    window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", plan);
    showRange();
    draw();
  }
}
