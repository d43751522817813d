// SPDX-License-Identifier: Apache-2.0
// The journal, newest entries first. Later ones come in by events, earlier ones on demand.
import type { JournalEntry } from "./answers";
import type { Api } from "./api";
import type { City } from "./city";
import { el, foreign, refill } from "./dom";
import { isWordKey, moment, t } from "./words";

const ROWS = 100;
// So many entries are kept at most; earlier ones are forgotten while the page stays open for long.
const ENTRIES_MAX = 5000;

export class HistoryPanel {
  readonly element = el("div");
  private readonly list = el("ul", { class: "rows", id: "history" });
  private readonly older = el("button", { class: "more", words: "older" });
  private entries: JournalEntry[] = []; // ascending
  private rows = ROWS;
  private waits = false;

  constructor(
    private readonly api: Api,
    private readonly city: City,
    private readonly onSelect: (id: number) => void,
    private readonly onError: (error: unknown) => void,
  ) {
    this.element.append(this.list, this.older);
    this.older.addEventListener("click", () => void this.readOlder());
    city.onChange(() => this.render());
  }

  // The number of the last entry of the journal. No route tells it, so it is searched: O(log n).
  async findLast(): Promise<number> {
    const has = async (sequence: number) => {
      const path = `/v1/journal?from=${sequence}&count=1`;
      return (await this.api.json<JournalEntry[]>(path)).length > 0;
    };
    let low = 0; // is there, or 0
    let high = 1;
    while (await has(high)) [low, high] = [high, 2 * high];
    while (high - low > 1) {
      const middle = Math.floor((low + high) / 2);
      if (await has(middle)) low = middle;
      else high = middle;
    }
    return low;
  }

  async start(last: number): Promise<void> {
    await this.readBefore(last + 1);
  }

  add(entry: JournalEntry): void {
    if (entry.sequence <= (this.entries.at(-1)?.sequence ?? 0)) return;
    this.entries.push(entry);
    if (this.entries.length > ENTRIES_MAX) this.entries.splice(0, ROWS);
    if (this.waits) return;
    this.waits = true;
    requestAnimationFrame(() => {
      this.waits = false;
      this.render();
    });
  }

  render(): void {
    const rows = this.entries
      .slice(-this.rows)
      .map((entry) => this.row(entry))
      .reverse();
    refill(this.list, rows);
    const isAll = this.rows >= this.entries.length && (this.entries[0]?.sequence ?? 1) <= 1;
    this.older.hidden = isAll;
  }

  private async readOlder(): Promise<void> {
    this.rows += ROWS;
    const first = this.entries[0]?.sequence ?? 1;
    if (first <= 1 || this.entries.length >= this.rows) return this.render();
    try {
      await this.readBefore(first);
    } catch (error) {
      this.onError(error);
    }
  }

  private async readBefore(sequence: number): Promise<void> {
    const from = Math.max(1, sequence - ROWS);
    if (from >= sequence) return this.render();
    const path = `/v1/journal?from=${from}&count=${sequence - from}`;
    const read = await this.api.json<JournalEntry[]>(path);
    // Somebody may have asked for them twice.
    const first = this.entries[0]?.sequence ?? sequence;
    this.entries = [...read.filter((entry) => entry.sequence < first), ...this.entries];
    this.render();
  }

  private row(entry: JournalEntry): HTMLElement {
    const key = `did_${entry.action}`;
    const action = el("span", { class: "action" }, isWordKey(key) ? t(key) : entry.action);
    const item = el("li", { class: "card" });
    item.append(el("span", { class: "quiet" }, moment(entry.time)), " ");
    item.append(foreign(entry.actor, "name"), " ", action, " ");
    if (entry.image !== null) item.append(this.imageNode(entry.image, entry.sequence), " ");
    if (entry.reconstruction !== null) {
      const text = t("model", { number: String(entry.reconstruction) });
      item.append(el("span", { class: "badge" }, text));
    }
    if (entry.detail) item.append(el("p", {}, foreign(entry.detail)));
    return item;
  }

  private imageNode(id: number, sequence: number): HTMLElement {
    const photo = this.city.byId.get(id);
    if (!photo) return el("span", {}, t("photo_number", { number: String(id) }));
    const button = el("button", { class: "chip", onClick: () => this.onSelect(id) });
    button.dataset.key = `entry-${sequence}`;
    button.append(foreign(photo.image));
    return button;
  }
}
