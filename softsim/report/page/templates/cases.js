// The table of cases: sorted, searched, and shown a page at a time, so that ten thousand rows cost
// no more than a hundred. A click on a point of a chart leads to the row of its case.

const ROWS_ON_A_PAGE = 100;

const section = document.querySelector(".cases");
const { headings, columns, factors, measures } = JSON.parse(section.querySelector("script").textContent);
const caseNumbers = columns[headings.indexOf("case")];
const rowOf = new Map(caseNumbers.map((number, row) => [number, row]));
const everyRow = caseNumbers.map((_, row) => row);
const numeric = columns.map((column) => column.every((value) => value === null || typeof value === "number"));
let searched = null;
let sortedBy = { column: headings.indexOf("case"), sign: 1 };
let shown = everyRow;
let first = 0;
let chosen = null;

function written(value) {
  if (value === null) return "";
  return typeof value === "number" && !Number.isInteger(value) ? String(Number(value.toPrecision(4))) : String(value);
}

function textOf(row) {
  searched ??= everyRow.map((each) => columns.map((column) => written(column[each])).join("\n").toLowerCase());
  return searched[row];
}

// Rows in which every word is found, in the chosen order; empty cells stay last.
function arrange() {
  const words = section.querySelector("input").value.toLowerCase().split(/\s+/).filter(Boolean);
  const { column, sign } = sortedBy;
  const values = columns[column];
  const compare = numeric[column]
    ? (a, b) => values[a] - values[b]
    : (a, b) => collator.compare(written(values[a]), written(values[b]));
  const found = everyRow.filter((row) => words.every((word) => textOf(row).includes(word)));
  const filled = found.filter((row) => values[row] !== null && values[row] !== "");
  const empty = found.filter((row) => values[row] === null || values[row] === "");
  shown = [...filled.sort((a, b) => sign * compare(a, b) || a - b), ...empty];
  first = 0;
}

const collator = new Intl.Collator("en", { numeric: true });

function rowElement(row) {
  const element = document.createElement("tr");
  element.tabIndex = -1;
  element.dataset.case = caseNumbers[row];
  element.classList.toggle("chosen", caseNumbers[row] === chosen);
  columns.forEach((column, number) => {
    const cell = element.insertCell();
    cell.textContent = cell.title = written(column[row]);
    cell.className = numeric[number] ? "number" : "text";
  });
  return element;
}

function show() {
  const last = Math.min(first + ROWS_ON_A_PAGE, shown.length);
  section.querySelector("tbody").replaceChildren(...shown.slice(first, last).map(rowElement));
  section.querySelector("output").textContent =
    shown.length === 0 ? "no case" : `${first + 1} to ${last} of ${shown.length}`;
  section.querySelector(".previous").disabled = first === 0;
  section.querySelector(".next").disabled = last === shown.length;
}

function turn(pages) {
  first += pages * ROWS_ON_A_PAGE;
  show();
}

function lead(number) {
  const row = rowOf.get(number);
  if (!shown.includes(row)) {
    section.querySelector("input").value = "";
    arrange();
  }
  chosen = number;
  first = Math.floor(shown.indexOf(row) / ROWS_ON_A_PAGE) * ROWS_ON_A_PAGE;
  show();
  const element = section.querySelector("tr.chosen");
  element.scrollIntoView({ block: "center" });
  element.focus({ preventScroll: true });
}

headings.forEach((heading, column) => {
  const element = document.createElement("th");
  element.scope = "col";
  element.setAttribute("aria-sort", column === sortedBy.column ? "ascending" : "none");
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = heading;
  button.addEventListener("click", () => {
    const rising = element.getAttribute("aria-sort") !== "ascending";
    for (const other of element.parentElement.cells) other.setAttribute("aria-sort", "none");
    element.setAttribute("aria-sort", rising ? "ascending" : "descending");
    sortedBy = { column, sign: rising ? 1 : -1 };
    arrange();
    show();
  });
  element.append(button);
  section.querySelector("thead tr").append(element);
});

section.querySelector("form").addEventListener("submit", (event) => event.preventDefault());
section.querySelector("input").addEventListener("input", () => { arrange(); show(); });
section.querySelector(".previous").addEventListener("click", () => turn(-1));
section.querySelector(".next").addEventListener("click", () => turn(1));
// What the cursor shows over a point: its case and factors, and what was measured.
function wordsOf(point) {
  const row = rowOf.get(point.customdata);
  const line = (heading) => `${heading}: ${written(columns[headings.indexOf(heading)][row])}`;
  if (point.data.meta?.mean) {
    return [`case ${point.customdata} and others like it`, ...factors.map(line), `mean: ${point.text ?? written(point.y)}`];
  }
  const reason = columns[headings.indexOf("reason")][row];
  return [`case ${point.customdata}`, ...factors.map(line), ...(reason ? [reason] : measures.map(line))];
}

const tip = document.querySelector(".tip");

function showTip(point, { clientX, clientY }) {
  tip.textContent = wordsOf(point).join("\n");
  tip.hidden = false;
  tip.style.left = `${Math.max(4, Math.min(clientX + 14, innerWidth - tip.offsetWidth - 8))}px`;
  tip.style.top = `${Math.max(4, Math.min(clientY + 14, innerHeight - tip.offsetHeight - 8))}px`;
}

for (const chart of document.querySelectorAll("figure.chart")) {
  chart.addEventListener("drawn", () => {
    const plot = chart.querySelector(".plot");
    const isCase = (point) => rowOf.has(point.customdata);
    plot.on("plotly_click", ({ points: [point] }) => { if (isCase(point)) lead(point.customdata); });
    plot.on("plotly_hover", ({ points: [point], event }) => { if (isCase(point)) showTip(point, event); });
    plot.on("plotly_unhover", () => { tip.hidden = true; });
  });
}
show();
