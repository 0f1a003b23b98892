// The lanes of certificates: what the cursor says of them, and where they are after a zoom.
leave(() => {
  const checks = {};
  const room = one("#mend .test"), figure = room.querySelector(".timeline"), end = Number(figure.dataset.end);
  const readout = () => room.querySelector(".readout").textContent;
  const press = key => figure.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, cancelable: true }));
  const share = text => parseFloat(text) / 100;
  const states = [...figure.querySelectorAll(".state")], lines = [...figure.querySelectorAll(".hazard")];
  const missed = lines.find(line => line.matches(".missed"));
  checks["there are states of both sides"] = figure.querySelectorAll(".states").length === 4;
  checks["a missed hazard has a line and words"] = Boolean(missed) && room.textContent.includes("MISSED");
  checks["the line has a tooltip"] = missed.getAttribute("aria-label").includes("MISSED");
  checks["each state says why"] = states.some(state => state.getAttribute("aria-label").includes(" because "));
  press("ArrowRight");
  checks["the cursor names states"] = readout().includes("transport: ");
  checks["and evidence"] = readout().includes("brakes_ok: ");
  const before = share(missed.getAttribute("x1"));
  const band = states.find(state => share(state.getAttribute("width")) > 0.5), wide = share(band.getAttribute("width"));
  press("+");
  const after = share(missed.getAttribute("x1"));
  checks["a zoom moves hazards"] = after !== before;
  checks["and stretches states"] = share(band.getAttribute("width")) >= wide;
  const shown = [...figure.querySelectorAll(".state-name:not(.out)")].map(name => share(name.getAttribute("x")));
  checks["names stay in sight"] = shown.length > 0 && shown.every(x => x >= 0 && x <= 1);
  press("0");
  checks["and back"] = Math.abs(share(missed.getAttribute("x1")) - before) < 1e-6;
  return { checks, end, readout: readout() };
});
