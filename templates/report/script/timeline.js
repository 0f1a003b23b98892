// Timelines: a cursor with the values of all metrics, a zoom that all timelines share, and a second test laid over one.
(() => {
  const whole = Math.max(0, ...[...document.querySelectorAll(".timeline")].map(figure => Number(figure.dataset.end)));
  const zoom = { from: 0, to: whole };
  const nameOf = figure => figure.closest(".test").id;
  const figures = [...document.querySelectorAll(".timeline")].map(figure => {
    const end = Number(figure.dataset.end), share = text => parseFloat(text) / 100;
    const plots = [...figure.querySelectorAll("svg.plot")], axis = plots[plots.length - 1];
    axis.replaceChildren();
    figure.querySelectorAll(".plot > .grid").forEach(line => line.remove());
    const spans = [...figure.querySelectorAll(".plot > rect")].map(rect => {
      const from = end * share(rect.getAttribute("x"));
      return { rect, from, to: from + end * share(rect.getAttribute("width")) };
    });
    const marks = ".plot > circle, .plot > .ended, .plot > .hazard, .plot > .hazard-name, .plot > .mark";
    const points = [...figure.querySelectorAll(marks)].map(mark => {
      const keys = mark.tagName === "circle" ? ["cx"] : mark.tagName === "text" ? ["x"] : ["x1", "x2"];
      return { mark, keys, time: end * share(mark.getAttribute(keys[0])) };
    });
    const names = [...figure.querySelectorAll(".plot > .state-name")].map(name => {
      const until = end * share(name.dataset.until);
      return { name, from: end * share(name.getAttribute("x")), to: until, letters: name.textContent.length };
    });
    const rows = plots.slice(0, -1).map(plot => rowOf(plot, spans));
    return { figure, end, axis, spans, points, names, rows, other: null };
  });
  if (!figures.length) { return; }

  // A lane of an operation, or the line of a metric with its scale.
  function rowOf(plot, spans) {
    const tall = Number(plot.getAttribute("height")), grid = part("g", { "class": "lines" });
    const cursor = part("line", { "class": "cursor", y1: 0, y2: tall, visibility: "hidden" });
    const value = part("text", { "class": "cursor-value", visibility: "hidden" });
    plot.prepend(grid);
    plot.append(cursor, value);
    const row = { plot, tall, grid, cursor, value, metric: plot.dataset.metric };
    if (row.metric === undefined) {
      row.name = plot.closest(".row").querySelector(".label b").textContent;
      row.seen = spans.filter(span => span.rect.parentNode === plot && span.rect.matches(".seen"));
      row.states = spans.filter(span => span.rect.parentNode === plot && span.rect.dataset.state);
      return row;
    }
    row.frame = plot.querySelector("svg");
    row.paths = [...row.frame.querySelectorAll("path")];
    row.bounds = [...plot.querySelectorAll(".bound")].map(line => ({ line, y: Number(line.getAttribute("y1")) }));
    row.dots = [...plot.querySelectorAll("circle")].map(dot => ({ dot, y: Number(dot.getAttribute("cy")) }));
    row.ticks = [...plot.querySelectorAll(".tick")];
    row.low = Number(plot.dataset.low);
    row.high = Number(plot.dataset.high);
    row.unit = plot.dataset.unit;
    return row;
  }
  const MARGIN = 15;
  const height = (row, low, high, value) => MARGIN + (1 - (value - low) / (high - low)) * (row.tall - 2 * MARGIN);
  const valueAt = (row, y) => row.high - (y - MARGIN) / (row.tall - 2 * MARGIN) * (row.high - row.low);

  // The steps of a line, from its path: when each begins, and its height; null where there is nothing.
  function steps(row) {
    if (row.steps) { return row.steps; }
    const found = [];
    let time = 0, y = 0;
    row.paths.filter(path => !path.matches(".bad, .other")).forEach(path => {
      for (const [, letter, first, second] of path.getAttribute("d").matchAll(/([MHV])([-\d.]+)(?: ([-\d.]+))?/g)) {
        if (letter === "H") { time = Number(first); continue; }
        if (letter === "M") { time = Number(first); }
        y = Number(letter === "M" ? second : first);
        found.push([time, y]);
      }
      found.push([time, null]);
    });
    row.steps = found.sort((a, b) => a[0] - b[0] || (a[1] !== null) - (b[1] !== null));
    return row.steps;
  }
  function valueOf(row, time) {
    let y = null;
    for (const step of steps(row)) {
      if (step[0] > time) { break; }
      y = step[1];
    }
    return y === null ? null : valueAt(row, y);
  }

  const shareOf = time => (time - zoom.from) / (zoom.to - zoom.from);
  const percent = share => 100 * share + "%";
  function draw() {
    const { ticks, decimals } = ticksBetween(zoom.from, zoom.to, 8);
    figures.forEach(({ axis, spans, points, names, rows }) => {
      axis.replaceChildren(...ticks.map((tick, n) => part("text", {
        "class": n % 2 ? "tick middle wide" : "tick middle", x: percent(shareOf(tick)), y: 14,
      }, tick.toFixed(decimals) + (n + 1 === ticks.length ? " s" : ""))));
      rows.forEach(({ grid, frame, tall }) => {
        grid.replaceChildren(...ticks.map(tick => part("line", {
          "class": "grid", x1: percent(shareOf(tick)), x2: percent(shareOf(tick)), y1: 0, y2: tall,
        })));
        if (frame) { frame.setAttribute("viewBox", [zoom.from, 0, zoom.to - zoom.from, tall].join(" ")); }
      });
      spans.forEach(({ rect, from, to }) => {
        const left = Math.max(0, shareOf(from)), right = Math.min(1, shareOf(to));
        rect.setAttribute("visibility", right > left || (right === left && left > 0 && left < 1) ? "visible" : "hidden");
        rect.setAttribute("x", percent(left));
        rect.setAttribute("width", percent(Math.max(0, right - left)));
      });
      // The name of a state stands where the part of its band begins that is seen, if it has room there.
      names.forEach(({ name, from, to, letters }) => {
        const left = Math.max(0, shareOf(from)), right = Math.min(1, shareOf(to));
        name.setAttribute("x", percent(left));
        const room = (right - left) * axis.getBoundingClientRect().width;
        name.classList.toggle("out", room < 7 * letters + 10);
      });
      points.forEach(({ mark, keys, time }) => {
        const share = shareOf(time);
        mark.setAttribute("visibility", share >= 0 && share <= 1 ? "visible" : "hidden");
        keys.forEach(key => mark.setAttribute(key, percent(share)));
      });
    });
    pointAt(null);
  }

  // The cursor is in all timelines; its values are in that at which someone looks.
  let pointed = null;
  function pointAt(at) {
    pointed = at;
    figures.forEach(drawn => {
      const here = at && at.drawn === drawn, x = at ? shareOf(at.time) : 0, active = [], values = [];
      drawn.rows.forEach(row => {
        row.cursor.setAttribute("visibility", at ? "visible" : "hidden");
        row.value.setAttribute("visibility", "hidden");
        if (!at) { return; }
        row.cursor.setAttribute("x1", percent(x));
        row.cursor.setAttribute("x2", percent(x));
        if (!here) { return; }
        if (row.seen) {
          const state = row.states.find(span => span.from <= at.time && at.time < span.to);
          if (state) { values.push(row.name + ": " + state.rect.dataset.state); }
          if (row.seen.some(span => span.from <= at.time && at.time < span.to)) { active.push(row.name); }
          return;
        }
        const value = valueOf(row, at.time);
        if (value === null) { return; }
        const scale = row.scale || row, words = withUnit(value, decimalsOf([row.low + 1e-9, row.high]), row.unit);
        values.push(row.metric + " " + words);
        row.value.textContent = words;
        row.value.setAttribute("visibility", "visible");
        row.value.setAttribute("class", x > 0.5 ? "cursor-value end" : "cursor-value");
        row.value.setAttribute("x", percent(x));
        row.value.setAttribute("dx", x > 0.5 ? -6 : 6);
        const y = height(row, scale.low, scale.high, value);
        row.value.setAttribute("y", Math.max(11, y - 6 < 11 ? y + 15 : y - 6));
      });
      const said = at ? [at.time.toFixed(2) + " s"].concat(values, active.length ? ["active: " + active.join(", ")] : []) : [];
      drawn.readout.textContent = here ? said.join(" · ") : "";
    });
  }
  function zoomTo(from, to) {
    const shortest = whole / 1000;
    if (to - from < shortest) { to = from + shortest; }
    zoom.from = Math.max(0, from);
    zoom.to = Math.min(whole, to);
    figures.forEach(({ reset }) => { reset.hidden = zoom.from === 0 && zoom.to === whole; });
    draw();
  }
  function zoomBy(factor, around) {
    const half = (zoom.to - zoom.from) * factor / 2, room = Math.min(half, whole / 2);
    const middle = Math.min(whole - room, Math.max(room, around));
    zoomTo(middle - room, middle + room);
  }

  // Lays the lines of another test over those of this one; both share a scale that holds both.
  function compare(drawn, other) {
    drawn.rows.filter(row => row.frame).forEach(row => {
      row.frame.querySelectorAll(".other").forEach(path => path.remove());
      const second = other && other.rows.find(candidate => candidate.metric === row.metric);
      const scale = { low: Math.min(row.low, second ? second.low : row.low), high: Math.max(row.high, second ? second.high : row.high) };
      row.scale = second ? scale : null;
      const moved = (of, y) => height(row, scale.low, scale.high, valueAt(of, y));
      const move = of => "translate(0 " + moved(of, 0) + ") scale(1 " + (moved(of, of.tall) - moved(of, 0)) / of.tall + ")";
      row.paths.forEach(path => path.setAttribute("transform", move(row)));
      row.bounds.forEach(({ line, y }) => ["y1", "y2"].forEach(key => line.setAttribute(key, moved(row, y))));
      row.dots.forEach(({ dot, y }) => dot.setAttribute("cy", moved(row, y)));
      const decimals = decimalsOf([scale.low, scale.high]);
      row.ticks.forEach((tick, n) => { tick.textContent = fixed(n ? scale.low : scale.high, decimals); });
      if (second) {
        second.paths.filter(path => !path.matches(".bad")).forEach(path => {
          row.frame.prepend(part("path", { "class": "line other", d: path.getAttribute("d"), transform: move(second) }));
        });
      }
    });
  }

  figures.forEach((drawn, at) => {
    const { figure, rows } = drawn, bar = barBefore(figure);
    bar.classList.add("of-timeline");
    // Only metrics have lines that can be laid over each other.
    const hasLines = of => of.rows.some(row => row.frame);
    const others = hasLines(drawn) ? figures.filter(other => other !== drawn && hasLines(other)) : [];
    if (others.length) {
      const field = choice(bar, "compare with (dashed)", ["–"].concat(others.map(other => nameOf(other.figure))), 0,
        () => compare(drawn, field.value === "0" ? null : others[field.value - 1]));
    }
    bar.append(button("−", "zoom out", () => zoomBy(2, (zoom.from + zoom.to) / 2)));
    bar.append(button("+", "zoom in", () => zoomBy(0.5, pointed ? pointed.time : (zoom.from + zoom.to) / 2)));
    drawn.reset = button("whole run", "", () => zoomTo(0, whole));
    drawn.reset.hidden = true;
    drawn.readout = element("output", "readout");
    bar.append(drawn.reset, drawn.readout);
    if (at === 0) {
      bar.parentNode.insertBefore(element("p", "quiet", "Drag across a timeline to zoom into all of them. With the keyboard: arrow keys move the "
        + "cursor, + and − zoom, 0 shows the whole run."), bar);
    }

    figure.tabIndex = 0;
    figure.setAttribute("role", "group");
    let drag = null;
    const timeAt = event => {
      const box = rows.length ? rows[0].plot.getBoundingClientRect() : figure.getBoundingClientRect();
      const share = Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
      return zoom.from + share * (zoom.to - zoom.from);
    };
    figure.addEventListener("pointermove", event => {
      if (!event.target.closest(".plot") && !drag) { return; }
      const time = timeAt(event);
      if (drag) {
        const [from, to] = [Math.min(drag.from, time), Math.max(drag.from, time)];
        drag.marks.forEach(mark => {
          mark.setAttribute("x", percent(shareOf(from)));
          mark.setAttribute("width", percent(shareOf(to) - shareOf(from)));
        });
      }
      pointAt({ drawn, time });
    });
    figure.addEventListener("pointerleave", () => { if (!drag) { pointAt(null); } });
    figure.addEventListener("pointerdown", event => {
      if (event.button !== 0 || event.pointerType === "touch" || !event.target.closest(".plot")) { return; }
      event.preventDefault();
      figure.focus({ preventScroll: true });
      const marks = rows.map(row => part("rect", { "class": "zooming", y: 0, height: row.tall, width: 0 }));
      rows.forEach((row, n) => row.plot.append(marks[n]));
      drag = { from: timeAt(event), x: event.clientX, marks };
      figure.setPointerCapture(event.pointerId);
    });
    const drop = event => {
      if (!drag) { return; }
      const { from, x, marks } = drag, to = timeAt(event);
      marks.forEach(mark => mark.remove());
      drag = null;
      if (event.type === "pointerup" && Math.abs(event.clientX - x) > 4) { zoomTo(Math.min(from, to), Math.max(from, to)); }
    };
    figure.addEventListener("pointerup", drop);
    figure.addEventListener("pointercancel", drop);
    figure.addEventListener("dblclick", () => zoomTo(0, whole));
    figure.addEventListener("keydown", event => {
      const time = pointed && pointed.drawn === drawn ? pointed.time : (zoom.from + zoom.to) / 2;
      const step = (zoom.to - zoom.from) / (event.shiftKey ? 10 : 100);
      const within = time => Math.min(zoom.to, Math.max(zoom.from, time));
      const acts = {
        ArrowLeft: () => pointAt({ drawn, time: within(time - step) }),
        ArrowRight: () => pointAt({ drawn, time: within(time + step) }),
        "+": () => zoomBy(0.5, time), "-": () => zoomBy(2, time), "0": () => zoomTo(0, whole), Escape: () => pointAt(null),
      };
      if (acts[event.key] && !event.ctrlKey && !event.metaKey && event.target === figure) { event.preventDefault(); acts[event.key](); }
    });
  });
  draw();
})();
