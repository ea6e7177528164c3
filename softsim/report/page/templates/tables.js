// A click on a heading sorts its table, a second one the other way round; empty cells stay last.

function compareCells(a, b) {
  if (a.dataset.value !== undefined && b.dataset.value !== undefined) {
    return Number(a.dataset.value) - Number(b.dataset.value);
  }
  return a.textContent.localeCompare(b.textContent, "en", { numeric: true });
}

function sortRows(table, column, sign) {
  const rows = Array.from(table.tBodies[0].rows, (row) => ({ row, cell: row.cells[column] }));
  const filled = rows.filter(({ cell }) => cell.textContent !== "");
  const empty = rows.filter(({ cell }) => cell.textContent === "");
  filled.sort((a, b) => sign * compareCells(a.cell, b.cell));
  table.tBodies[0].append(...[...filled, ...empty].map(({ row }) => row));
}

for (const heading of document.querySelectorAll("table.sortable th")) {
  heading.querySelector("button").addEventListener("click", () => {
    const rising = heading.getAttribute("aria-sort") !== "ascending";
    for (const other of heading.parentElement.cells) other.setAttribute("aria-sort", "none");
    heading.setAttribute("aria-sort", rising ? "ascending" : "descending");
    sortRows(heading.closest("table"), heading.cellIndex, rising ? 1 : -1);
  });
}
