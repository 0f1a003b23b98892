// What can be taken along: pictures, tables, blocks and commands.
leave(() => {
  const checks = {}, saved = [];
  let text = "", copied = "";
  window.Blob = function (parts) { text = parts.join(""); };
  URL.createObjectURL = () => "";
  HTMLAnchorElement.prototype.click = function () { saved.push({ name: this.download, text }); };
  Object.defineProperty(navigator, "clipboard", { value: { writeText: words => { copied = words; return Promise.resolve(); } } });
  window.dispatchEvent(new Event("load"));
  const press = (room, words) => [...room.querySelectorAll("button")].filter(it => it.textContent === words).forEach(it => it.click());

  press(document, "Save as SVG");
  const pictures = saved.splice(0), read = pictures.map(picture => new DOMParser().parseFromString(picture.text, "image/svg+xml"));
  checks["there are pictures of charts and timelines"] = pictures.length > 5;
  checks["each is an image of its own"] = read.every(it => it.documentElement.localName === "svg" && !it.querySelector("parsererror"));
  checks["their names say what they are"] = pictures.every(it => /^[a-z0-9-]+\.svg$/.test(it.name)) && pictures.some(it => /-t\d+\.svg$/.test(it.name));
  checks["nothing depends on the page"] = pictures.every(it => !/class=|var\(|style=/.test(it.text));
  const chart = one("#front .chart") || one(".chart"), dots = chart.querySelectorAll("circle").length;
  checks["all dots are in it"] = dots > 0 && read.some(it => it.querySelectorAll("circle").length === dots);
  const labels = [...one("figure.timeline").querySelectorAll(".label b")].map(it => it.textContent);
  const words = read.map(it => [...it.querySelectorAll("text")].map(each => each.textContent));
  checks["words beside a drawing are, too"] = labels.length > 0 && words.some(found => labels.every(label => found.includes(label)));
  const drawn = read.flatMap(it => [...it.querySelectorAll("path, circle, rect")]);
  checks["shapes have colours"] = drawn.every(it => it.getAttribute("fill") || it.getAttribute("stroke"));

  const table = one("main table:not(.tests)");
  press((table.closest(".scroll") || table).nextElementSibling, "Save as CSV");
  const lines = saved.splice(0)[0].text.split("\r\n");
  checks["a table has a line for each row"] = lines.length === table.rows.length + 1 && lines.pop() === "";
  checks["and its titles"] = lines[0].split(",")[0] === table.rows[0].cells[0].textContent.trim();
  const data = JSON.parse(one("#all-tests").textContent);
  press(one(".viewport").nextElementSibling, "Save as CSV");
  const whole = saved.splice(0)[0].text.trim().split("\r\n");
  checks["that of all tests has each of them"] = whole.length === data.numbers.length + 1;

  const block = one("main pre");
  press(block.nextElementSibling, "Copy");
  checks["a test can be copied"] = copied === block.textContent && copied.includes("test ");
  press(one("main .command"), "Copy");
  checks["and the command that shows it"] = copied.startsWith("sesamec show ");
  return { checks };
});
