// A page that is served takes in what is new of its run, while another process goes on with it.

import { $ } from "./common.js";
import { anyViolated } from "./criteria_rows.js";
import { columns, data, rows } from "./data.js";
import { filters } from "./filters.js";
import { number } from "./numbers.js";

const EVERY = 1500; // ms between two questions while the run grows
const SELDOM = 5000; // once it has ended, or the server does not answer

class Live {
  constructor() {
    this.finished = data.summary.finished;
    $("live").hidden = false;
    $("live-reload").addEventListener("click", () => location.reload());
    this.say(this.finished ? "The search has ended" : "Live: the search goes on");
    this.ask();
  }

  say(text, state = this.finished ? "ended" : "grows") {
    if ($("live-text").textContent !== text) $("live-text").textContent = text;
    $("live").dataset.state = state;
  }

  async ask() {
    if (!document.hidden) await this.fetch();
    const seldom = this.finished || $("live").dataset.state === "lost";
    setTimeout(() => this.ask(), seldom ? SELDOM : EVERY);
  }

  async fetch() {
    try {
      const response = await fetch(`news?after=${rows.n}`);
      const news = await response.json();
      if (news.error) throw new Error(news.error.join("; "));
      this.finished = news.finished;
      if (news.rows) this.take(news);
      const done = `${number(rows.n)} of ${number(data.summary.budget)} evaluations`;
      this.say(this.finished ? `The search has ended: ${done}` : `Live: ${done}`);
      this.offer(news);
    } catch (error) {
      this.say(error instanceof TypeError ? "No longer served: this is what was known last" : `Cannot be read: ${error.message}`, "lost");
    }
  }

  // What only a page that is loaded anew can show.
  offer({ kept, elsewhere: confirmed }) {
    const known = data.confirmations.reduce((sum, one) => sum + one.scenarios.length, 0);
    const what = kept > data.kept.length ? "the exported files" : confirmed > known ? "what other simulators confirmed" : "";
    $("live-reload").hidden = !what;
    if (what) $("live-reload").textContent = `Show ${what}`;
  }

  take(news) {
    const shape = () => [rows.critical.includes(1), anyViolated(), Boolean(rows.findings), Boolean(data.triage), rows.cause === null, data.regions === null, data.confirmations.map(({ simulator }) => simulator)].join();
    const before = shape();
    if (news.whole) ["evaluation", "iteration", "critical", "cause"].forEach((name) => { if (rows[name]) rows[name].length = 0; });
    for (const name of ["evaluation", "iteration", "critical"]) append(rows[name], news.rows[name]);
    const first = rows.evaluation.length - news.rows.evaluation.length;
    if (news.rows.cause) rows.cause = append(rows.cause ?? new Array(first).fill(0), news.rows.cause);
    else if (rows.cause) append(rows.cause, new Array(news.rows.evaluation.length).fill(0));
    for (const { name, values } of news.rows.columns) {
      const column = columns.get(name);
      if (news.whole) column.values.length = 0;
      append(column.values, values);
    }
    takeFindings(news);
    const { n, n_failed, n_critical, rank, front } = news.rows;
    Object.assign(rows, { n, n_failed, n_critical, rank, front });
    Object.assign(data, { summary: news.summary, implausible: news.implausible, ...news.sections });
    if (shape() !== before) location.reload(); // there is something that the page has no place for yet
    else {
      document.dispatchEvent(new CustomEvent("grown"));
      filters.notify();
    }
  }
}

// The findings of new rows under the numbers that the page has for them.
function takeFindings({ whole, rows: { findings } }) {
  if (!findings || !rows.findings || whole) {
    rows.findings = findings ?? rows.findings;
    return;
  }
  const known = rows.findings.keys, texts = known.map((key) => key.join("\n"));
  const numbers = findings.keys.map((key) => {
    const k = texts.indexOf(key.join("\n"));
    if (k >= 0) return k;
    texts.push(key.join("\n"));
    return known.push(key) - 1;
  });
  append(rows.findings.at, findings.at.map((k) => numbers[k]));
}

// Pushing in one call would need too many arguments.
function append(list, more) {
  for (const one of more) list.push(one);
  return list;
}

new Live();
