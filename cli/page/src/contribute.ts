// SPDX-License-Identifier: Apache-2.0
// Sends photos to the city, two at a time, and asks what became of each.
import type { Outcome, PhotoDetails, Upload, Verdict } from "./answers";
import { ConnectionLost, Problem, type Api } from "./api";
import { PartedFile } from "./parted_file";

export type Stage =
  | "line" // waits on this page
  | "sending"
  | "later" // the daemon asked to come again later
  | "lost" // the connection was lost; it is sent again
  | "waiting" // it is on the daemon's disk and waits for its turn
  | "broken" // it could not be sent
  | "judged" // `verdict` and `words` tell what became of it
  | "refused" // `words` tell why
  | "unknown"; // its turn has come, and the daemon has forgotten it

// What a person says of all photos that are sent together; "": nothing.
export interface Remarks {
  readonly comment: string;
  readonly licence: string;
}

// Photos that are sent together.
interface Contribution extends Remarks {
  readonly contributor: string;
  number: Promise<number> | null; // once it was asked for
  isClosed: boolean;
}

export interface Job {
  file: File;
  contribution: Contribution | null; // null: nothing is said of it
  contributor: string; // "": the daemon chooses
  camera: string; // "": it is found by the photo
  stage: Stage;
  verdict: Verdict | null;
  words: string; // the daemon's
  photo: number | null; // its number in the city
  upload: Upload | null;
}

const SENDERS = 2;
const POLLED_MAX = 8; // uploads that are asked for at once; their turns come in their order
const POLL_MS = 1_500;
const PAUSE_MS = 5_000; // where the daemon names no Retry-After
const PAUSE_MS_MAX = 30_000;
// The daemon has no room just now, or a proxy before it finds it away.
const LATER = new Set([429, 502, 503, 504]);
// A connection that ends so often while a body is sent, though the daemon is alive, will not hold;
// or the file cannot be read, which a browser tells in the same way.
const LOST_COUNT_MAX = 5;

export class Sender {
  readonly jobs: Job[] = [];
  private active = 0;
  private isPolling = false;
  private contribution: Contribution | null = null; // of the photos that were added last

  // `onChange` is told of each step of a job.
  constructor(
    private readonly api: Api,
    private readonly onChange: (job: Job) => void,
  ) {}

  add(files: Iterable<File>, contributor: string, camera: string, remarks: Remarks): void {
    const isRemarked = remarks.comment !== "" || remarks.licence !== "";
    const contribution = isRemarked ? this.contributionFor(remarks, contributor) : null;
    for (const file of files) {
      const job: Job = {
        file,
        contribution,
        contributor,
        camera,
        stage: "line",
        verdict: null,
        words: "",
        photo: null,
        upload: null,
      };
      this.jobs.push(job);
      this.onChange(job);
    }
    this.sendNext();
  }

  // Goes on with the one that is open, where it says the same.
  private contributionFor(remarks: Remarks, contributor: string): Contribution {
    const last = this.contribution;
    const isSame =
      last?.comment === remarks.comment &&
      last.licence === remarks.licence &&
      last.contributor === contributor;
    if (last && isSame && !last.isClosed) return last;
    return (this.contribution = { ...remarks, contributor, number: null, isClosed: false });
  }

  get doneCount(): number {
    return this.jobs.filter((job) => isOver(job)).length;
  }

  // Whether there are photos that the daemon does not have yet.
  get hasUnsent(): boolean {
    return this.jobs.some((job) => !isOver(job) && job.stage !== "waiting");
  }

  private sendNext(): void {
    while (this.active < SENDERS) {
      const job = this.jobs.find((one) => one.stage === "line");
      if (!job) return;
      ++this.active;
      this.set(job, { stage: "sending" });
      void this.send(job).finally(() => {
        --this.active;
        this.sendNext();
      });
    }
  }

  private async send(job: Job): Promise<void> {
    const file = new PartedFile(this.api, job.file);
    for (let lost = 0, pauseMs = 1_000; ; ) {
      this.set(job, { stage: "sending" });
      const before = file.arrivedBytes;
      try {
        const arrived = await file.send(await this.metadataOf(job));
        this.wait(job, {
          ...arrived,
          state: "waiting",
          outcome: null,
          why_not: null,
          awaits_camera: false,
        });
        return;
      } catch (error) {
        if (error instanceof Problem) {
          if (!LATER.has(error.status)) {
            return this.set(job, { stage: "refused", words: error.message });
          }
          this.set(job, { stage: "later", words: error.message });
          const seconds = error.retryAfterSeconds;
          await sleep(seconds === null ? PAUSE_MS : 1000 * seconds);
        } else if (error instanceof ConnectionLost) {
          if (file.arrivedBytes > before) {
            lost = 0;
            pauseMs = 1_000;
          } else if (await this.isAlive()) ++lost;
          if (lost >= LOST_COUNT_MAX) return this.set(job, { stage: "broken", words: "" });
          this.set(job, { stage: "lost", words: "" });
          await sleep(pauseMs);
          pauseMs = Math.min(2 * pauseMs, PAUSE_MS_MAX);
        } else {
          return this.set(job, { stage: "broken", words: String(error) });
        }
      }
    }
  }

  private async metadataOf(job: Job): Promise<Record<string, string>> {
    const metadata: Record<string, string> = { filename: job.file.name };
    if (job.file.type.startsWith("image/")) metadata.filetype = job.file.type;
    if (job.contributor) metadata.contributor = job.contributor;
    if (job.camera) metadata.camera = job.camera;
    if (job.contribution) metadata.contribution = String(await this.numberOf(job.contribution));
    return metadata;
  }

  // Opens it where that was not done yet.
  private numberOf(contribution: Contribution): Promise<number> {
    const { comment, licence, contributor } = contribution;
    contribution.number ??= this.api
      .send<{ contribution: number }>("/v1/contributions", { comment, licence, contributor })
      .then((opened) => opened.contribution)
      .catch((error: unknown) => {
        contribution.number = null; // the next photo tries again
        throw error;
      });
    return contribution.number;
  }

  // Once the daemon has all of its photos, or never will.
  private closeIfDone(contribution: Contribution): void {
    const isLeft = (job: Job) =>
      job.contribution === contribution && !isOver(job) && job.stage !== "waiting";
    if (contribution.isClosed || !contribution.number || this.jobs.some(isLeft)) return;
    contribution.isClosed = true;
    void contribution.number
      .then((number) => this.api.send(`/v1/contributions/${number}/close`, {}))
      .catch(() => undefined); // one that stays open does no harm
  }

  private async isAlive(): Promise<boolean> {
    try {
      await this.api.request("/healthz");
      return true;
    } catch (error) {
      return error instanceof Problem;
    }
  }

  private wait(job: Job, upload: Upload): void {
    this.set(job, { stage: "waiting", words: upload.why_not ?? "", upload });
    if (!this.isPolling) void this.poll();
  }

  private judge(job: Job, outcome: Outcome): void {
    this.set(job, {
      stage: "judged",
      verdict: outcome.verdict,
      words: outcome.reason,
      photo: outcome.id,
    });
  }

  private async poll(): Promise<void> {
    this.isPolling = true;
    for (;;) {
      await sleep(POLL_MS);
      const waiting = this.jobs.filter((job) => job.stage === "waiting");
      if (waiting.length === 0) break;
      waiting.sort((a, b) => (a.upload?.upload ?? 0) - (b.upload?.upload ?? 0));
      await Promise.all(waiting.slice(0, POLLED_MAX).map((job) => this.ask(job)));
    }
    this.isPolling = false;
  }

  private async ask(job: Job): Promise<void> {
    try {
      const upload = await this.api.json<Upload>(`/v1/uploads/${job.upload?.upload}`);
      if (upload.outcome) this.judge(job, upload.outcome);
      else if (upload.state === "waiting") this.set(job, { words: upload.why_not ?? "" });
      else this.set(job, { stage: "refused", words: upload.why_not ?? "" });
    } catch (error) {
      // Nothing is known of a lost connection: it is asked again.
      if (error instanceof Problem && error.status === 404) await this.findPhoto(job);
      else if (error instanceof Problem && error.status < 500 && error.status !== 429) {
        this.set(job, { stage: "unknown", words: error.message });
      }
    }
  }

  // A daemon that began anew does not remember an upload, but the city has the photo.
  private async findPhoto(job: Job): Promise<void> {
    const name = `${job.upload?.contributor}/${job.upload?.image}`;
    try {
      const photo = await this.api.json<PhotoDetails>(`/v1/photos/${encodeURIComponent(name)}`);
      this.judge(job, photo);
    } catch (error) {
      if (error instanceof Problem && error.status < 500) this.set(job, { stage: "unknown" });
    }
  }

  private set(job: Job, change: Partial<Job>): void {
    Object.assign(job, change);
    this.onChange(job);
    if (job.contribution) this.closeIfDone(job.contribution);
  }
}

export function isOver(job: Job): boolean {
  return ["broken", "judged", "refused", "unknown"].includes(job.stage);
}

function sleep(ms: number): Promise<void> {
  return new Promise((resolve) => setTimeout(resolve, ms));
}
