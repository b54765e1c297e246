// SPDX-License-Identifier: Apache-2.0
// The recorded sessions, and what is done with them.
import type {BackgroundJob, DaemonStatus, ExportRequest_Format, JobProgress, ListSessionsResponse_Entry as Entry, Light} from './api.gen';
import {act} from './act';
import {el, Keyed, set, setText, show} from './dom';
import {bytes, count, dateAndTime, percent, plural} from './format';
import {Sign} from './light';
import {call, follow} from './wire';

export function sessionState(entry: Entry): [Light, string] {
  if (entry.error !== '') return ['RED', 'unreadable'];
  if (entry.state === 'COMPLETE') return entry.lost > 0 ? ['AMBER', 'complete, frames lost'] : ['GREEN', 'complete'];
  if (entry.state === 'SALVAGED') return ['AMBER', 'salvaged'];
  return entry.state === 'RECORDING' ? ['AMBER', 'open'] : ['LIGHT_UNSPECIFIED', 'unknown'];
}

/** What is done to a session in the background: "being salvaged, 34 %". */
export function jobWords(job: BackgroundJob): string {
  const salvages = job.kind === 'SALVAGE';
  if (job.state === 'PAUSED') return `${salvages ? 'salvage' : 'compression'} stands still while something is recorded`;
  if (job.state === 'RUNNING') return `${salvages ? 'being salvaged' : 'being compressed'}, ${percent(job.fraction)}`;
  return `waits to be ${salvages ? 'salvaged' : 'compressed'}`;
}

/** A job's report (JSON) in lines: "frames: 14400". What is nested is left to the file. */
export function reportLines(report: string): string[] {
  try {
    const json = JSON.parse(report) as unknown;
    if (json === null || typeof json !== 'object') return [String(json)];
    return Object.entries(json).filter(([, value]) => typeof value !== 'object' || value === null || (Array.isArray(value) && value.every(item => typeof item !== 'object')))
      .map(([name, value]) => `${name.replaceAll('_', ' ')}: ${Array.isArray(value) ? value.join(', ') || 'none' : String(value)}`);
  } catch {
    return report === '' ? [] : [report];
  }
}

class Row {
  private readonly sign = new Sign();
  private readonly state = el('span');
  private readonly cells = Array.from({length: 6}, () => el('td'));
  private readonly progress = el('progress', {max: 1, value: 0});
  private readonly doing = el('span', {role: 'status'});
  private readonly report = el('ul', {class: 'report'});
  private readonly job = el('div', {class: 'job', hidden: true}, this.progress, this.doing, this.report);
  private readonly buttons: HTMLButtonElement[];
  private readonly reconstruct: HTMLButtonElement;
  private readonly background = el('span', {class: 'background', role: 'status', hidden: true});
  private entry?: Entry;
  private busy = false;
  private salvaged = false;
  readonly root: HTMLTableRowElement;

  constructor(readonly session: string, private readonly changed: () => void) {
    const button = (words: string, run: () => void) => el('button', {type: 'button', 'aria-label': `${words} ${session}`, onclick: run}, words);
    const exporting = (format: ExportRequest_Format) => () => this.run(tell => follow('Sessions/Export', {session, format}, tell));
    this.reconstruct = button('Reconstruct', () => void act(call('Reconstruct/Start', {session})).then(answer => {
      if (answer) document.getElementById('reconstruction')?.scrollIntoView();
    }));
    this.buttons = [
      button('Verify', () => this.run(tell => follow('Sessions/Verify', {session}, tell))),
      button('Repair', () => this.run(tell => follow('Sessions/Repair', {session}, tell))),
      button('Export images', exporting('PNG')),
      button('Export videos', exporting('VIDEO')),
    ];
    const names = ['When', 'Of', 'Cameras', 'Frames', 'Lost', 'Size'];
    this.cells.forEach((cell, place) => set(cell, 'data-name', names[place]));
    this.root = el('tr', {'data-session': session},
      el('th', {scope: 'row'}, session, el('span', {class: 'state'}, this.sign.root, this.state), this.background), ...this.cells,
      el('td', {class: 'actions'}, el('div', {}, ...this.buttons, this.reconstruct), this.job));
  }

  show(entry: Entry): void {
    this.entry = entry;
    const [light, word] = sessionState(entry);
    this.sign.show(light);
    setText(this.state, entry.error ? `${word}: ${entry.error}` : word);
    [dateAndTime(entry.created_utc), entry.purpose, count(entry.cameras), count(entry.frames), count(entry.lost), bytes(entry.bytes)]
      .forEach((text, place) => setText(this.cells[place]!, text));
    set(this.cells[4]!, 'data-bad', entry.lost > 0);
    this.enable();
  }

  /** What is done to it in the background; nothing else is while it is salvaged. */
  showJob(job: BackgroundJob | undefined): void {
    show(this.background, job !== undefined);
    setText(this.background, job ? jobWords(job) : '');
    if (this.salvaged === (job?.kind === 'SALVAGE')) return;
    this.salvaged = !this.salvaged;
    this.enable();
  }

  private enable(): void {
    for (const button of this.buttons) button.disabled = this.busy || this.salvaged;
    this.reconstruct.disabled = this.busy || this.salvaged || !this.entry?.calibrated;
    set(this.reconstruct, 'title', this.entry?.calibrated ? undefined : 'Its cameras are not calibrated, or the volume is not known.');
  }

  private run(job: (tell: (progress: JobProgress) => void) => Promise<JobProgress>): void {
    this.busy = true;
    this.enable();
    show(this.job, true);
    this.report.replaceChildren();
    set(this.job, 'data-ok', undefined);
    void act(job(progress => {
      this.progress.value = progress.fraction;
      setText(this.doing, `${progress.doing} ${percent(progress.fraction)}`);
    })).then(last => {
      this.busy = false;
      this.enable();
      set(this.job, 'data-ok', String(last?.ok ?? false));
      setText(this.doing, !last ? 'It failed.' : last.ok ? `Done: ${last.doing || 'all is well'}` : `Failed: ${last.doing}`);
      this.report.replaceChildren(...reportLines(last?.report ?? '').map(line => el('li', {}, line)));
      this.changed();
    });
  }
}

export class Sessions {
  private readonly body = el('tbody');
  private readonly note = el('p', {class: 'note'}, 'None yet.');
  private readonly rows = new Keyed<Entry, Row>(this.body, session => new Row(session, () => void this.refresh()), (row, entry) => row.show(entry));
  private shown = '';
  private jobs: BackgroundJob[] = [];
  readonly root: HTMLElement;

  constructor() {
    const heads = ['Session', 'When', 'Of', 'Cameras', 'Frames', 'Lost', 'Size', 'Actions'];
    this.root = el('section', {id: 'sessions', class: 'panel', 'aria-labelledby': 'sessions-title'},
      el('header', {}, el('h2', {id: 'sessions-title'}, 'Sessions'), this.note,
        el('button', {class: 'quiet', type: 'button', onclick: () => void this.refresh()}, 'Read again')),
      el('div', {class: 'scroll'}, el('table', {}, el('thead', {}, el('tr', {}, ...heads.map(head => el('th', {scope: 'col'}, head)))), this.body)));
  }

  /** Read again when a recording came, went or changed its state, or something was done to a session. */
  show(status: DaemonStatus): void {
    this.jobs = status.jobs;
    this.showJobs();
    const key = `${status.recording?.session} ${status.recording?.state} ${status.jobs.map(job => `${job.kind} ${job.session}`).join()}`;
    if (key === this.shown) return;
    this.shown = key;
    void this.refresh();
  }

  async refresh(): Promise<void> {
    const list = await act(call('Sessions/List'));
    if (!list) return;
    this.rows.show(list.sessions, entry => entry.session);
    setText(this.note, list.sessions.length === 0 ? 'None yet.' : plural(list.sessions.length, 'session'));
    show(this.body.closest('.scroll')!, list.sessions.length > 0);
    this.showJobs();
  }

  private showJobs(): void {
    for (const [session, row] of this.rows.views) row.showJob(this.jobs.find(job => job.session === session));
  }
}
