// Fronts by generation: a slider moves through them.
document.querySelectorAll(".fronts").forEach(function (room) {
  var fronts = JSON.parse(room.dataset.fronts), controls = barBefore(room.firstElementChild);
  var slider = document.createElement("input"), said = document.createElement("output");
  slider.type = "range"; slider.min = 0; slider.max = fronts.length; slider.value = fronts.length;
  control(controls, "Generation", slider);
  controls.append(said);
  function show() {
    var at = Number(slider.value), one = at < fronts.length;
    room.classList.toggle("one-front", one);
    said.textContent = one ? fronts[at][0] + ": " + fronts[at][1] + " on the front" : "all";
    room.querySelectorAll("svg[data-best]").forEach(function (chart) {
      var places = [];
      chart.querySelectorAll("circle").forEach(function (dot) {
        var on = Number(dot.dataset.from) <= at && at <= Number(dot.dataset.to);
        dot.classList.toggle("on", on);
        if (on) { places.push([parseFloat(dot.getAttribute("cx")), parseFloat(dot.getAttribute("cy"))]); }
      });
      places.sort(function (a, b) { return a[0] - b[0]; });
      if (chart.dataset.best === "right") { places.reverse(); }
      var line = chart.querySelector(".live");
      if (line) {
        line.setAttribute("d", places.map(function (place, n) {
          return n ? "H" + place[0] + "V" + place[1] : "M" + place[0] + " " + place[1];
        }).join(""));
      }
    });
  }
  slider.addEventListener("input", show);
  show();
});
