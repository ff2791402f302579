// Sorts and filters the table of many logs. The table is the data; nothing is fetched or parsed.

"use strict";

const table = document.getElementById("table");
const body = table.tBodies[0];
const rows = [...body.rows];
const heads = [...table.tHead.rows[0].cells];
const order = document.getElementById("order");
const filters = ["state", "kind", "words"].map((id) => document.getElementById(id));
const texts = new Map();
/** Of a row that is open: the row below it, as wide as the table, that shows what its name opens. */
const opened = new Map();

/** Sets rows in an order, each with what it opened. */
function place(ordered) {
  body.append(...ordered.flatMap((row) => opened.has(row) ? [row, opened.get(row)] : [row]));
}

/** The first column is too narrow for a verdict with its warnings. */
function unfold(row) {
  const details = row.querySelector("details");
  if (details.open && !opened.has(row)) {
    const below = document.createElement("tr");
    below.className = `${row.className} opened`;
    const cell = below.insertCell();
    cell.colSpan = row.cells.length;
    cell.append(details.querySelector(".more"));
    opened.set(row, below);
    row.after(below);
  } else if (!details.open && opened.has(row)) {
    details.append(opened.get(row).querySelector(".more"));
    opened.get(row).remove();
    opened.delete(row);
  }
}

/** What a cell is sorted by; a cell without it is a picture. */
function keyOf(row, column) {
  return row.cells[column].dataset.sort;
}

/** Numbers by size, text by letter; what is not known comes last, either way. */
function compare(one, other, sign) {
  if (one === "" || other === "") return (one === "") - (other === "");
  const [a, b] = [Number(one), Number(other)];
  const byNumber = !Number.isNaN(a) && !Number.isNaN(b);
  return sign * (byNumber ? a - b : one < other ? -1 : one > other ? 1 : 0);
}

function sortBy(column, direction) {
  const sign = direction === "descending" ? -1 : 1;
  const keyed = rows.map((row, place) => [row, keyOf(row, column), place]);
  keyed.sort((a, b) => compare(a[1], b[1], sign) || a[2] - b[2]);
  place(keyed.map(([row]) => row));
  heads.forEach((head, place) => {
    if (place === column) head.setAttribute("aria-sort", direction);
    else head.removeAttribute("aria-sort");
  });
  order.value = `${column} ${direction}`;
}

/** Most want the worst end and the surest finding first, and the newest flight. */
function firstDirection(column) {
  return ["accused", "date, UTC", "in the air"].includes(heads[column].dataset.name) ? "descending" : "ascending";
}

function textOf(row) {
  if (!texts.has(row)) texts.set(row, `${row.textContent} ${opened.get(row)?.textContent ?? ""}`.toLowerCase());
  return texts.get(row);
}

function filter() {
  const [state, kind, words] = filters.map((one) => one.value);
  const wanted = words.toLowerCase().split(/\s+/).filter(Boolean);
  let count = 0;
  for (const row of rows) {
    const fits = (!state || row.dataset.state === state) && (!kind || row.dataset.kind === kind)
      && wanted.every((word) => textOf(row).includes(word));
    row.hidden = !fits;
    if (opened.has(row)) opened.get(row).hidden = !fits;
    count += fits;
  }
  document.getElementById("shown").textContent = `${count} of ${rows.length}`;
}

/** A point of a trend leads to its log, also where that is filtered out. */
function reveal() {
  const row = rows.find((one) => `#${one.id}` === location.hash);
  if (!row) return;
  if (row.hidden) {
    for (const one of filters) one.value = "";
    filter();
  }
  row.querySelector("details").open = true;
  row.scrollIntoView({ block: "center" });
}

function start() {
  document.documentElement.classList.add("scripted");
  order.append(new Option("worst first", ""), new Option("as listed", "listed"));
  for (const row of rows) row.querySelector("details").addEventListener("toggle", () => unfold(row));
  heads.forEach((head, column) => {
    head.dataset.name = head.textContent;
    if (!rows.length || keyOf(rows[0], column) === undefined) return;
    const button = document.createElement("button");
    button.type = "button";
    button.textContent = head.textContent;
    head.replaceChildren(button);
    const first = firstDirection(column);
    const second = first === "ascending" ? "descending" : "ascending";
    button.addEventListener("click", () => sortBy(column, head.getAttribute("aria-sort") === first ? second : first));
    order.append(new Option(head.dataset.name, `${column} ${first}`), new Option(`${head.dataset.name}, reversed`, `${column} ${second}`));
  });
  order.addEventListener("change", () => {
    if (order.value === "" || order.value === "listed") {
      const number = (row) => Number(row.id.slice("log-".length));
      place(order.value ? rows.toSorted((a, b) => number(a) - number(b)) : rows);
      for (const head of heads) head.removeAttribute("aria-sort");
    } else {
      const [column, direction] = order.value.split(" ");
      sortBy(+column, direction);
    }
  });
  for (const one of filters) one.addEventListener("input", filter);
  addEventListener("hashchange", reveal);
  filter();
  reveal();
}

start();
