// The page of a batch: find, filter and sort its programs.
const $ = id => document.getElementById(id);
const programs = document.querySelector("#programs tbody"), rows = [...programs.rows];
const heads = [...document.querySelectorAll("#programs th")];

function filter() {
  const words = $("find").value.toLowerCase().split(/\s+/).filter(Boolean), outcome = $("outcome").value;
  let count = 0;
  for (const row of rows) {
    const text = row.dataset.text;
    row.hidden = (outcome && row.dataset.outcome !== outcome) || !words.every(each => text.includes(each));
    count += !row.hidden;
  }
  $("shown").textContent = `${count} of ${rows.length} programs`;
}

const value = (row, column) => {
  const { textContent: text, dataset: { value: number } } = row.cells[column];
  return number === undefined ? text.toLowerCase() : number === "" ? -Infinity : +number;
};

heads.forEach((head, column) => {
  const button = document.createElement("button");
  button.type = "button";
  button.append(...head.childNodes);
  head.append(button);
  button.addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending" || (head.className === "n" && !head.hasAttribute("aria-sort"));
    heads.forEach(each => each.removeAttribute("aria-sort"));
    head.setAttribute("aria-sort", down ? "descending" : "ascending");
    const order = (a, b) => { const [x, y] = [value(a, column), value(b, column)]; return x < y ? -1 : x > y ? 1 : 0; };
    programs.append(...[...rows].sort((a, b) => down ? order(b, a) : order(a, b)));
  });
});
for (const button of document.querySelectorAll("button[data-find]")) {
  button.addEventListener("click", () => {
    $("find").value = button.dataset.find;
    $("outcome").value = button.dataset.outcome;
    filter();
    $("find").focus();
  });
}
$("find").addEventListener("input", filter);
$("outcome").addEventListener("change", filter);
filter();
document.documentElement.dataset.ready = "yes";
