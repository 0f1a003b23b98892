// The tests in the reduced space: turned by dragging or with the arrow keys, and chosen anew for each weight. The
// choices of all weights are in the data, so that nothing is computed here but where things are seen.
const SEEN = document.getElementById("space");
const SPACE = SEEN && JSON.parse(document.getElementById("space-data").textContent);

function spaceOf(room, data) {
  const picture = room.querySelector("svg");
  const state = { turn: data.turn, tilt: data.tilt, lambda: data.lambda, size: 0 };
  const said = element("p", "said");
  said.setAttribute("aria-live", "polite");
  const fit = () => ({ width: Math.max(280, Math.min(736, room.clientWidth)), height: Math.max(300, Math.min(520, room.clientWidth * 0.8)) });

  function turned([x, y, z]) {
    const [a, b, c] = [x - 0.5, y - 0.5, z - 0.5];
    return [a * Math.cos(state.turn) + b * Math.sin(state.turn), b * Math.cos(state.turn) - a * Math.sin(state.turn), c];
  }
  function stretchAt(lambda) {
    const found = data.stretches.findIndex(it => lambda <= it.to);
    return found < 0 ? data.stretches.length - 1 : found;
  }

  function draw() {
    const { width, height } = fit();
    const scale = Math.min(width, height) / 1.75;
    const place = point => {
      const [x, y, z] = turned(point);
      return [width / 2 + x * scale, height / 2 - (z * Math.cos(state.tilt) + y * Math.sin(state.tilt)) * scale];
    };
    const depth = point => { const [, y, z] = turned(point); return y * Math.cos(state.tilt) - z * Math.sin(state.tilt); };
    const at = stretchAt(state.lambda);
    const chosen = data.stretches.length ? data.stretches[at].chosen : [];
    const parts = [];
    const line = (kind, from, to) => {
      const [[x1, y1], [x2, y2]] = [place(from), place(to)];
      parts.push(part("line", { class: kind, x1, y1, x2, y2 }));
    };
    const count = data.axes.length;
    const corner = set => [0, 1, 2].map(nth => (set >> nth) & 1);
    for (let bits = 0; bits < 1 << count; bits += 1) {
      for (let axis = 0; axis < count; axis += 1) {
        if (bits & (1 << axis)) { continue; }
        line("cube", corner(bits), corner(bits | (1 << axis)));
      }
    }
    const middleOf = (from, to) => from.map((value, nth) => (value + to[nth]) / 2);
    data.axes.forEach((axis, nth) => {
      // Of the edges along a dimension, the one beside which its name covers nothing.
      const edges = [];
      for (let bits = 0; bits < 1 << count; bits += 1) {
        if (!(bits & (1 << nth))) { edges.push([corner(bits), corner(bits | (1 << nth))]); }
      }
      const outside = ([from, to]) => { const [x, y] = place(middleOf(from, to)); return nth === 2 ? x : -y; };
      const [from, to] = edges.reduce((best, edge) => (outside(edge) < outside(best) ? edge : best));
      const middle = middleOf(from, to);
      const [mx, my] = place(middle);
      const away = [mx - width / 2, my - height / 2];
      const length = Math.max(1, Math.hypot(...away));
      [["tick middle", from, axis.low], ["axis middle", middle, axis.name], ["tick middle", to, axis.high]].forEach(([kind, point, words]) => {
        const [x, y] = place(point);
        parts.push(part("text", { class: kind, x: x + 20 * away[0] / length, y: y + 18 * away[1] / length + 4 }, words));
      });
    });
    data.others.forEach(other => { const [cx, cy] = place(other); parts.push(part("circle", { class: "other", cx, cy, r: 2 })); });
    chosen.forEach((one, nth) => {
      chosen.slice(nth + 1).forEach(other => line("between", data.tests[one].at, data.tests[other].at));
      const [x, y] = data.tests[one].at;
      line("drop", data.tests[one].at, [x, y, 0]);
    });
    const [least, most] = data.radii;
    const order = data.tests.map((test, nth) => nth).sort((a, b) => depth(data.tests[b].at) - depth(data.tests[a].at));
    order.forEach(nth => {
      const test = data.tests[nth];
      const [cx, cy] = place(test.at);
      const interest = test.interest.length ? test.interest[state.size] : 0.5;
      const r = least + interest * (most - least);
      const mark = part("circle", { class: (chosen.includes(nth) ? "chosen" : "candidate") + " point", cx, cy, r, "data-name": test.name });
      hint(mark, test.tip);
      parts.push(mark);
      if (test.ran) { parts.push(part("circle", { class: "ran", cx, cy, r: r + 3, "pointer-events": "none" })); }
    });
    const taken = [];
    chosen.forEach(nth => {
      const { name, at: point } = data.tests[nth];
      const [x, y] = place(point);
      const long = name.length * 7;
      // A name that would cover another one is left out; pointing at the dot tells it.
      const spots = [[0, -15, "middle"], [14, 4, ""], [-14, 4, "end"], [0, 24, "middle"], [14, -13, ""], [14, 20, ""]];
      spots.some(([dx, dy, anchor]) => {
        const left = x + dx - (anchor === "end" ? long : anchor ? long / 2 : 0);
        const box = [left, y + dy - 11, left + long, y + dy + 3];
        if (taken.some(other => box[0] < other[2] && other[0] < box[2] && box[1] < other[3] && other[1] < box[3])) { return false; }
        taken.push(box);
        parts.push(part("text", { class: `test ${anchor}`, x: x + dx, y: y + dy }, name));
        return true;
      });
    });
    picture.setAttribute("viewBox", `0 0 ${width} ${height}`);
    picture.style.width = `${width}px`;
    picture.replaceChildren(...parts);
    picture.setAttribute("aria-label", `${chosen.length} of ${data.tests.length} candidates are chosen: ${chosen.map(nth => data.tests[nth].name).join(", ")}`);
    say(at, chosen);
  }

  function say(at, chosen) {
    const names = list => list.map(nth => data.tests[nth].name).join(" ") || "none";
    const words = [`λ ${state.lambda.toFixed(2)}: ${names(chosen)}.`];
    if (data.stretches.length) {
      const here = data.stretches[at];
      words.push(`This is the best choice for λ from ${here.from.toFixed(3)} to ${here.to.toFixed(3)}.`);
      const next = data.stretches[at + 1];
      if (next) {
        const enter = next.chosen.filter(nth => !chosen.includes(nth));
        const leave = chosen.filter(nth => !next.chosen.includes(nth));
        words.push(`Above that, ${names(enter)} ${enter.length === 1 ? "enters" : "enter"} for ${names(leave)}.`);
      }
    }
    said.textContent = words.join(" ");
  }

  const bar = element("div", "controls");
  room.insertBefore(bar, picture);
  const slider = element("input");
  Object.assign(slider, { type: "range", min: 0, max: 1, step: 0.005, value: data.lambda });
  control(bar, "Interest (λ 0) to difference (λ 1)", slider).id = "lambda";
  slider.addEventListener("input", () => { state.lambda = Number(slider.value); draw(); });
  if (data.sizes.length > 1) {
    const field = choice(bar, "Size by", data.sizes, 0, () => { state.size = Number(field.value); draw(); });
  }
  bar.append(button("As declared", "", () => {
    Object.assign(state, { turn: data.turn, tilt: data.tilt, lambda: data.lambda });
    slider.value = data.lambda;
    draw();
  }));
  room.append(said);

  function turn(by, up) {
    state.turn += by;
    state.tilt = Math.min(Math.PI / 2, Math.max(0, state.tilt + up));
    draw();
  }
  picture.setAttribute("tabindex", "0");
  picture.addEventListener("keydown", event => {
    const keys = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] };
    if (keys[event.key]) { event.preventDefault(); turn(...keys[event.key]); }
  });
  let held = null;
  picture.addEventListener("pointerdown", event => { if (event.button === 0) { held = [event.clientX, event.clientY]; } });
  window.addEventListener("pointermove", event => {
    if (!held) { return; }
    turn((event.clientX - held[0]) * 0.01, (event.clientY - held[1]) * 0.01);
    held = [event.clientX, event.clientY];
  });
  ["pointerup", "pointercancel"].forEach(end => window.addEventListener(end, () => { held = null; }));
  window.addEventListener("resize", draw);
  draw();
}

if (SEEN) { spaceOf(SEEN, SPACE); }
