// Cursor, zoom and comparison of timelines.
leave(() => {
  const checks = {}, figures = all(".timeline"), figure = figures.find(it => it.querySelector("[data-metric]"));
  const article = figure.closest(".test"), bar = figure.previousElementSibling, readout = bar.querySelector("output");
  const end = Number(figure.dataset.end), key = name => figure.dispatchEvent(new KeyboardEvent("keydown", { key: name }));
  const plot = figure.querySelector("[data-metric]"), cursor = () => plot.querySelector(".cursor");
  key("ArrowLeft");
  checks["a key shows the cursor"] = cursor().getAttribute("visibility") === "visible" && Math.abs(parseFloat(cursor().getAttribute("x1")) - 49) < 0.01;
  const metric = plot.dataset.metric, words = readout.textContent;
  checks["with time and values"] = words.startsWith((0.49 * end).toFixed(2) + " s") && words.includes(metric + " ");
  const path = plot.querySelector("svg path.line:not(.bad):not(.default)").getAttribute("d");
  const [, , y] = /M([-\d.]+) ([-\d.]+)/.exec(path);
  let held = Number(y);
  for (const [, letter, value] of path.slice(1).matchAll(/([HV])([-\d.]+)/g)) {
    if (letter === "H" && Number(value) > 0.49 * end) { break; }
    if (letter === "V") { held = Number(value); }
  }
  const [low, high] = [Number(plot.dataset.low), Number(plot.dataset.high)];
  const expected = high - (held - 15) / 46 * (high - low);
  checks["the value is that of the line"] = Math.abs(parseFloat(plot.querySelector(".cursor-value").textContent) - expected) <= 0.01 * (high - low) + 0.51;
  checks["all timelines have the cursor"] = all(".cursor[visibility=visible]").length === all(".cursor").length;
  checks["its values are in one"] = all(".readout").filter(it => it.textContent !== "").length === 1;
  key("Escape");
  checks["and it goes away"] = all(".cursor[visibility=visible]").length === 0 && readout.textContent === "";

  const box = plot.getBoundingClientRect(), at = share => ({ clientX: box.left + share * box.width, clientY: box.top + 5, bubbles: true, button: 0, pointerId: 1 });
  figure.setPointerCapture = () => {};
  plot.dispatchEvent(new PointerEvent("pointerdown", at(0.25)));
  plot.dispatchEvent(new PointerEvent("pointermove", at(0.5)));
  checks["dragging shows what is chosen"] = figure.querySelectorAll(".zooming").length > 0;
  plot.dispatchEvent(new PointerEvent("pointerup", at(0.5)));
  const frames = all(".timeline .plot > svg").map(frame => frame.getAttribute("viewBox").split(" ").map(Number));
  checks["all timelines zoom"] = frames.every(frame => Math.abs(frame[0] - end / 4) < 0.5 && Math.abs(frame[2] - end / 4) < 0.5);
  const spans = all(".plot > rect[visibility=visible]");
  checks["windows stay within"] = spans.every(rect => parseFloat(rect.getAttribute("x")) >= 0 && parseFloat(rect.getAttribute("x")) + parseFloat(rect.getAttribute("width")) <= 100.001);
  const axis = [...figure.querySelectorAll(".plot:last-of-type")].pop();
  const ticks = [...axis.querySelectorAll("text")].map(tick => parseFloat(tick.textContent));
  checks["the axis says where"] = ticks.length > 2 && ticks.every(tick => tick >= end / 4 - 0.5 && tick <= end / 2 + 0.5);
  const whole = [...bar.querySelectorAll("button")].pop();
  checks["there is a way back"] = !whole.hidden;
  whole.click();
  const back = all(".timeline .plot > svg").every(frame => frame.getAttribute("viewBox").startsWith("0 0 " + end + " "));
  checks["which leads back"] = back && whole.hidden;

  const before = plot.querySelector("svg path.line").getAttribute("transform");
  const names = all(".test").map(test => test.id).filter(id => id !== article.id);
  const other = names.find(id => one("#" + id + " [data-metric='" + metric + "']"));
  choose(bar, "compare", other);
  const laid = figure.querySelectorAll(".line.other");
  checks["another test is laid over"] = laid.length > 0;
  const second = one("#" + other + " [data-metric='" + metric + "'] svg path.line:not(.bad):not(.default)").getAttribute("d");
  checks["with its own line"] = [...plot.querySelectorAll(".line.other")].some(path => path.getAttribute("d") === second);
  checks["on one scale"] = parseFloat(plot.querySelectorAll(".tick")[0].textContent) >= Math.max(high, Number(one("#" + other + " [data-metric='" + metric + "']").dataset.high)) - 0.51;
  choose(bar, "compare", "–");
  checks["and taken away"] = figure.querySelectorAll(".line.other").length === 0 && before === null;
  return { checks, words, other, ticks };
});
