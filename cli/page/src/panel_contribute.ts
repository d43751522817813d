// SPDX-License-Identifier: Apache-2.0
// Where photos are dropped or chosen, and where the way of each is shown.
import type { Api } from "./api";
import type { City } from "./city";
import { isOver, Sender, type Job } from "./contribute";
import { el, foreign } from "./dom";
import { keepValue, keptValue } from "./kept";
import { verdictBadge } from "./panel_photos";
import { t, type WordKey } from "./words";

const CONTRIBUTOR_KEY = "veduta.contributor";

// That are proposed, by their identifiers (SPDX); any other text may be written.
const LICENCES = ["CC0-1.0", "CC-BY-4.0", "CC-BY-SA-4.0"];

const STAGE_WORDS: Record<Exclude<Job["stage"], "judged">, WordKey> = {
  line: "stage_line",
  sending: "stage_sending",
  later: "stage_later",
  lost: "stage_lost",
  waiting: "stage_waiting",
  broken: "stage_broken",
  refused: "stage_refused",
  unknown: "stage_unknown",
};

export interface ContributeActions {
  select(id: number): void;
  onDropped(): void; // photos were dropped, anywhere on the page
  onJudged(): void;
}

export class ContributePanel {
  readonly element = el("div", { class: "contribute" });
  private readonly sender: Sender;
  private readonly name = el("input", {
    id: "contributor",
    attributes: { type: "text", autocomplete: "nickname", maxlength: "200" },
  });
  private readonly nameLabel: HTMLLabelElement;
  private readonly camera = el("select", { id: "camera" });
  private readonly comment = el("input", {
    id: "comment",
    attributes: { type: "text", autocomplete: "off", maxlength: "500" },
  });
  private readonly licence = el("input", {
    id: "licence",
    attributes: { type: "text", autocomplete: "off", maxlength: "100", list: "licences" },
  });
  private readonly input = el("input", {
    id: "files",
    class: "hidden-input",
    attributes: { type: "file", multiple: "", tabindex: "-1", "aria-hidden": "true" },
  });
  private readonly summary = el("p", { class: "quiet", attributes: { role: "status" } });
  private readonly list = el("ul", { class: "rows", id: "uploads" });
  private readonly rows = new Map<Job, HTMLElement>();
  private camerasOf = ""; // what the options were made of

  constructor(
    private readonly api: Api,
    private readonly city: City,
    private readonly actions: ContributeActions,
  ) {
    this.sender = new Sender(api, (job) => {
      this.renderJob(job);
      if (job.stage === "judged") actions.onJudged();
    });
    this.nameLabel = el("label", { attributes: { for: "contributor" } });
    this.name.value = keptValue("localStorage", CONTRIBUTOR_KEY) ?? "";
    this.name.addEventListener("change", () => {
      keepValue("localStorage", CONTRIBUTOR_KEY, this.name.value.trim());
    });
    this.input.addEventListener("change", () => {
      this.send(this.input.files);
      this.input.value = "";
    });
    const choose = el("button", { class: "main", words: "choose" });
    choose.addEventListener("click", () => this.input.click());
    const zone = el("div", { class: "drop", id: "drop" }, el("p", { words: "drop" }), choose);
    this.element.append(this.nameLabel, this.name);
    this.element.append(
      el("label", { words: "camera", attributes: { for: "camera" } }),
      this.camera,
      el("label", { words: "comment", attributes: { for: "comment" } }),
      this.comment,
      el("label", { words: "licence_label", attributes: { for: "licence" } }),
      this.licence,
      el(
        "datalist",
        { id: "licences" },
        ...LICENCES.map((one) => el("option", { attributes: { value: one } })),
      ),
    );
    this.element.append(zone, this.input, this.summary, this.list);
    this.listenForDrops(zone);
    // What is not on the daemon's disk yet is lost with the page: the browser asks before.
    window.addEventListener("beforeunload", (event) => {
      if (this.sender.hasUnsent) event.preventDefault();
    });
    city.onChange(() => this.renderForm());
  }

  render(): void {
    this.camerasOf = "";
    this.renderForm();
    for (const job of this.rows.keys()) this.renderJob(job);
  }

  private send(files: FileList | null): void {
    if (!files || files.length === 0) return;
    const remarks = { comment: this.comment.value.trim(), licence: this.licence.value.trim() };
    this.sender.add([...files], this.name.value.trim(), this.camera.value, remarks);
  }

  // Photos may be dropped anywhere on the page: a file that misses the zone must not open.
  private listenForDrops(zone: HTMLElement): void {
    const hasFiles = (event: DragEvent) => event.dataTransfer?.types.includes("Files") ?? false;
    window.addEventListener("dragover", (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      zone.classList.add("over");
    });
    window.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) zone.classList.remove("over");
    });
    window.addEventListener("drop", (event) => {
      if (!hasFiles(event)) return;
      event.preventDefault();
      zone.classList.remove("over");
      this.actions.onDropped();
      this.send(event.dataTransfer?.files ?? null);
    });
  }

  private renderForm(): void {
    this.nameLabel.textContent = t(this.api.token === null ? "contributor" : "contributor_token");
    // A list that is open would close when its options are made anew.
    const cameras = JSON.stringify(this.city.cameras);
    if (cameras === this.camerasOf) return;
    this.camerasOf = cameras;
    const chosen = this.camera.value;
    const options = [el("option", { attributes: { value: "" } }, t("camera_any"))];
    for (const one of this.city.cameras) {
      options.push(el("option", { attributes: { value: one.name } }, `${one.name} (${one.size})`));
    }
    this.camera.replaceChildren(...options);
    this.camera.value = this.city.cameras.some((one) => one.name === chosen) ? chosen : "";
  }

  private renderJob(job: Job): void {
    let row = this.rows.get(job);
    if (!row) {
      row = el("li", { class: "card" });
      this.rows.set(job, row);
      this.list.prepend(row);
    }
    row.dataset.stage = job.stage;
    row.dataset.verdict = job.verdict ?? "";
    const hadFocus = row.contains(document.activeElement);
    row.replaceChildren(foreign(job.file.name, "name"), " ", stageNode(job));
    if (job.words) row.append(el("p", {}, foreign(job.words)));
    const id = job.photo;
    if (id !== null) {
      const show = el("button", { class: "chip", words: "show_photo" });
      show.addEventListener("click", () => this.actions.select(id));
      row.append(show);
      if (hadFocus) show.focus();
    }
    const done = { done: this.sender.doneCount, total: this.sender.jobs.length };
    const text = t("sent_summary", done);
    if (this.summary.textContent !== text) this.summary.textContent = text;
  }
}

function stageNode(job: Job): HTMLElement {
  if (job.stage === "judged") return verdictBadge(job.verdict ?? "failed");
  const className = isOver(job) ? "badge badge-rejected" : "badge";
  return el("span", { class: className }, t(STAGE_WORDS[job.stage]));
}
