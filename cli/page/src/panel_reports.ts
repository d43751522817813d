// SPDX-License-Identifier: Apache-2.0
// What people have reported, for curators: each photo with what is said of it, to hide it or to
// leave it as it is.
import type { Report } from "./answers";
import type { Api } from "./api";
import { el, foreign, moreButton, refill } from "./dom";
import { moment, t } from "./words";

const ROWS = 100;

export interface ReportActions {
  select(id: number): void;
  setHidden(id: number, isHidden: boolean): Promise<void>;
  onError(error: unknown): void;
}

export class ReportsPanel {
  readonly element = el("div");
  private readonly list = el("ul", { class: "rows", id: "reports" });
  private reports: Report[] = [];
  private rows = ROWS;

  constructor(
    private readonly api: Api,
    private readonly actions: ReportActions,
  ) {
    this.element.append(el("p", { class: "quiet", words: "reports_intro" }), this.list);
  }

  async read(): Promise<void> {
    try {
      this.reports = await this.api.json<Report[]>("/v1/reports");
      this.render();
    } catch (error) {
      this.actions.onError(error);
    }
  }

  render(): void {
    const items = this.reports.slice(0, this.rows).map((one) => this.item(one));
    if (items.length === 0) items.push(el("li", { class: "quiet" }, t("no_reports")));
    const more = moreButton(this.reports.length - this.rows, () => {
      this.rows += ROWS;
      this.render();
    });
    refill(this.list, more ? [...items, more] : items);
  }

  private item(report: Report): HTMLElement {
    const photo = el("button", { class: "chip", onClick: () => this.actions.select(report.id) });
    photo.append(foreign(report.image ?? String(report.id)));
    photo.dataset.key = `report-${report.report}`;
    const head = el("p", {}, photo, " ", t(`report_${report.reason}`));
    const who = t("by", { who: report.reporter, when: moment(report.time) });
    const item = el("li", { class: "card" }, head, el("p", { class: "quiet" }, who));
    if (report.text) item.append(el("p", {}, foreign(report.text)));
    const name = report.image ?? String(report.id);
    const hide = this.button(report, "hide_photo", name, async () => {
      await this.actions.setHidden(report.id, true);
    });
    const dismiss = this.button(report, "dismiss", name, async () => {
      await this.api.send(`/v1/reports/${report.report}/dismiss`, {});
    });
    item.append(el("div", { class: "buttons" }, hide, dismiss));
    return item;
  }

  // Its label says which photo it is about: the buttons of all reports have the same text.
  private button(
    report: Report,
    words: "hide_photo" | "dismiss",
    name: string,
    act: () => Promise<void>,
  ): HTMLElement {
    const button = el("button", { attributes: { "aria-label": `${t(words)}: ${name}` } }, t(words));
    button.dataset.key = `${words}-${report.report}`;
    button.addEventListener("click", () => {
      button.disabled = true;
      act()
        .catch((error: unknown) => this.actions.onError(error))
        .finally(() => void this.read());
    });
    return button;
  }
}
