// SPDX-License-Identifier: Apache-2.0
// The recorded sessions, and what is done with them.
import type {DaemonStatus, ExportRequest_Format, Job, Job_Kind, JobOutcome, ListSessionsResponse_Entry as Entry, Light, ReconstructRequest} from './api.gen';
import {act} from './act';
import {el, Keyed, set, setText, show} from './dom';
import {bytes, count, dateAndTime, percent, plural} from './format';
import {FrameChoice} from './frame_choice';
import {Sign} from './light';
import {QuantityChoice} from './quantity_choice';
import {call, follow} from './wire';

export function sessionState(entry: Entry): [Light, string] {
  if (entry.error !== '') return ['RED', 'unreadable'];
  if (entry.state === 'COMPLETE') return entry.lost > 0 ? ['AMBER', 'complete, frames lost'] : [entry.hosts_wanting > 0 ? 'AMBER' : 'GREEN', `complete${entry.hosts > 0 ? ' here' : ''}`];
  if (entry.state === 'SALVAGED') return ['AMBER', 'salvaged'];
  return entry.state === 'RECORDING' ? ['AMBER', 'open'] : ['LIGHT_UNSPECIFIED', 'unknown'];
}

/** Where else it is: "2 other hosts, 1 part wanting"; of another host's recording: "led by lab-1". */
export function hostsOf(entry: Entry): string {
  return [entry.hosts > 0 && plural(entry.hosts, 'other host'), entry.hosts_wanting > 0 && `${plural(entry.hosts_wanting, 'part')} wanting`,
          entry.led_by !== '' && `led by ${entry.led_by}`].filter(Boolean).join(', ');
}

const kinds: Record<Job_Kind, [string, string, string]> = {
  KIND_UNSPECIFIED: ['work', 'in work', 'done'],
  SALVAGE: ['salvage', 'being salvaged', 'salvaged'],
  COMPRESS: ['compression', 'being compressed', 'compressed'],
  FINISH: ['end', 'being finished', 'finished'],
  VERIFY: ['verification', 'being verified', 'verified'],
  REPAIR: ['repair', 'being repaired', 'repaired'],
  EXPORT: ['export', 'being exported', 'exported'],
  RECONSTRUCT: ['reconstruction', 'being reconstructed', 'reconstructed'],
};

/** What is done to a session: "being salvaged, 34 %". */
export function jobWords(job: Job): string {
  const [work, under, done] = kinds[job.kind];
  if (job.state === 'PAUSED') return `${work} stands still while something is recorded`;
  if (job.state !== 'RUNNING') return `waits to be ${done}`;
  return `${under}, ${percent(job.fraction)}${job.silent_s < 30 ? '' : `, nothing new for ${Math.round(job.silent_s)} s`}`;
}

/** What a job reports, in lines: "frames: 14400". */
export function reportLines(outcome: JobOutcome | undefined): string[] {
  if (!outcome) return [];
  const sum = <T>(cameras: T[], count: (camera: T) => number) => cameras.reduce((all, camera) => all + count(camera), 0);
  const frames = (words: string, number: number) => number > 0 ? [`${count(number)} ${words}`] : [];
  const {verify, repair, export: exported} = outcome;
  if (verify) {
    return [
      `${count(sum(verify.cameras, camera => camera.good))} of ${count(sum(verify.cameras, camera => camera.recorded))} frames are good`,
      ...frames('can\'t be read back', sum(verify.cameras, camera => camera.bad)),
      ...frames('are missing from the index', sum(verify.cameras, camera => camera.missing)),
      ...frames('are not in the index, but on the disk', sum(verify.cameras, camera => camera.unindexed)),
      ...verify.cameras.flatMap(camera => camera.problems.map(problem => `${camera.camera_id}: ${problem}`)), ...verify.problems,
      ...(verify.to_do ? [`${verify.to_do}.`] : []),
    ];
  }
  if (repair) {
    return [`${count(sum(repair.cameras, camera => camera.kept))} frames kept, ${count(sum(repair.cameras, camera => camera.lost))} lost`,
      repair.changed ? 'It was mended.' : 'There was nothing to mend.'];
  }
  if (exported) {
    return [`${count(sum(exported.cameras, camera => camera.frames))} frames in ${exported.folder}${exported.codec ? '' : ', one file a frame'}`,
      ...frames('could not be read back, and are left out', sum(exported.cameras, camera => camera.unreadable))];
  }
  return [];
}

/** Links to the videos that a job exported, one for each camera; none for images. */
function exportLinks(session: string, outcome: JobOutcome | undefined): HTMLElement[] {
  const exported = outcome?.export;
  if (!exported?.codec) return [];
  return exported.cameras.map(({file}) => el('li', {},
    el('a', {href: `/exports/${encodeURIComponent(session)}/video/${encodeURIComponent(file)}`, download: file}, file)));
}

/** A job of a session: what it does, and a button that ends it. */
class JobLine {
  private readonly words = el('span', {class: 'words'});
  private readonly cancel: HTMLButtonElement;
  private job?: Job;
  readonly root: HTMLElement;

  constructor(id: string, session: string) {
    this.cancel = el('button', {class: 'quiet', type: 'button', 'aria-label': `Cancel job ${id} on ${session}`, onclick: () => {
      if (this.job) void act(call('Jobs/Cancel', {id: this.job.id}));
    }}, 'Cancel');
    this.root = el('span', {}, this.words, this.cancel);
  }

  show(job: Job): void {
    this.job = job;
    setText(this.words, jobWords(job));
    show(this.cancel, job.kind !== 'FINISH');
  }
}

class Row {
  private readonly sign = new Sign();
  private readonly state = el('span');
  private readonly hosts = el('span', {class: 'hosts', hidden: true});
  private readonly cells = Array.from({length: 6}, () => el('td'));
  private readonly progress = el('progress', {max: 1, value: 0});
  private readonly doing = el('span', {role: 'status'});
  private readonly report = el('ul', {class: 'report'});
  private readonly job = el('div', {class: 'job', hidden: true}, this.progress, this.doing, this.report);
  private readonly buttons: HTMLButtonElement[];
  private readonly reconstruct: HTMLButtonElement;
  private readonly stylize: HTMLButtonElement;
  private readonly frame: FrameChoice;
  private readonly quantity: QuantityChoice;
  private readonly background = el('span', {class: 'background', role: 'status', hidden: true});
  private readonly jobs = new Keyed<Job, JobLine>(this.background, id => new JobLine(id, this.session), (line, job) => line.show(job));
  private entry?: Entry;
  private busy = false;
  private salvaged = false;
  readonly root: HTMLTableRowElement;

  constructor(readonly session: string, private readonly changed: () => void) {
    const button = (words: string, run: () => void) => el('button', {type: 'button', 'aria-label': `${words} ${session}`, onclick: run}, words);
    const exporting = (format: ExportRequest_Format) => () => this.run(tell => follow('Sessions/Export', {session, format}, tell));
    this.frame = new FrameChoice(session);
    this.quantity = new QuantityChoice(session);
    this.reconstruct = button('Reconstruct', () => {
      const frame = this.frame.request();
      if (frame) void this.quantity.request().then(quantity => quantity && this.start({session, ...frame, ...quantity}));
    });
    this.stylize = button('Stylize', () => {
      const frame = this.frame.request();
      if (frame) this.start({session, ...frame, stylize: true});
    });
    this.buttons = [
      button('Verify', () => this.run(tell => follow('Sessions/Verify', {session}, tell))),
      button('Repair', () => this.run(tell => follow('Sessions/Repair', {session}, tell))),
      button('Export images', exporting('PNG')),
      button('Export videos', exporting('VIDEO')),
    ];
    const names = ['When', 'Of', 'Cameras', 'Frames', 'Lost', 'Size'];
    this.cells.forEach((cell, place) => set(cell, 'data-name', names[place]));
    this.root = el('tr', {'data-session': session},
      el('th', {scope: 'row'}, el('bdi', {}, session), el('span', {class: 'state'}, this.sign.root, this.state), this.hosts, this.background), ...this.cells,
      el('td', {class: 'actions'}, el('div', {}, ...this.buttons, this.stylize, this.reconstruct, this.frame.root, this.quantity.root), this.job));
  }

  show(entry: Entry): void {
    this.entry = entry;
    const [light, word] = sessionState(entry);
    this.sign.show(light);
    setText(this.state, entry.error ? `${word}: ${entry.error}` : word);
    const hosts = hostsOf(entry);
    show(this.hosts, hosts !== '');
    setText(this.hosts, hosts);
    set(this.hosts, 'data-wanting', entry.hosts_wanting > 0);
    [dateAndTime(entry.created_utc), entry.purpose, count(entry.cameras), count(entry.frames), count(entry.lost), bytes(entry.bytes)]
      .forEach((text, place) => setText(this.cells[place]!, text));
    set(this.cells[4]!, 'data-bad', entry.lost > 0);
    this.enable();
  }

  /** What is done to it; nothing else is while it is salvaged. */
  showJobs(jobs: Job[]): void {
    this.jobs.show(jobs, job => String(job.id));
    show(this.background, jobs.length > 0);
    if (this.salvaged === jobs.some(job => job.kind === 'SALVAGE')) return;
    this.salvaged = !this.salvaged;
    this.enable();
  }

  private enable(): void {
    for (const button of this.buttons) button.disabled = this.busy || this.salvaged;
    this.reconstruct.disabled = this.stylize.disabled = this.busy || this.salvaged || !this.entry?.calibrated;
    if (this.entry) this.frame.show(this.entry, this.reconstruct.disabled);
    this.quantity.enable(!this.reconstruct.disabled);
    const missing = this.entry?.calibrated ? undefined : 'Its cameras are not calibrated, or the volume is not known.';
    set(this.reconstruct, 'title', missing);
    set(this.stylize, 'title', missing ?? 'Reconstruct a frame, and edit it while that goes on.');
  }

  private start(request: Partial<ReconstructRequest>): void {
    void act(call('Reconstruct/Start', request)).then(answer => {
      if (answer) document.getElementById('reconstruction')?.scrollIntoView();
    });
  }

  private run(job: (tell: (state: Job) => void) => Promise<Job>): void {
    this.busy = true;
    this.enable();
    show(this.job, true);
    this.report.replaceChildren();
    set(this.job, 'data-ok', undefined);
    void act(job(state => {
      this.progress.value = state.fraction;
      setText(this.doing, `${state.doing} ${percent(state.fraction)}`);
    })).then(last => {
      this.busy = false;
      this.enable();
      const ok = last?.outcome?.ok ?? false;
      set(this.job, 'data-ok', String(ok));
      setText(this.doing, !last ? 'It failed.' : ok ? 'Done: all is well' : 'Done: not all is well');
      this.report.replaceChildren(...reportLines(last?.outcome).map(line => el('li', {}, line)), ...exportLinks(this.session, last?.outcome));
      this.changed();
    });
  }
}

export class Sessions {
  private readonly body = el('tbody');
  private readonly note = el('p', {class: 'note'}, 'None yet.');
  private readonly rows = new Keyed<Entry, Row>(this.body, session => new Row(session, () => void this.refresh()), (row, entry) => row.show(entry));
  private shown = '';
  private jobs: Job[] = [];
  readonly root: HTMLElement;

  constructor() {
    const heads = ['Session', 'When', 'Of', 'Cameras', 'Frames', 'Lost', 'Size', 'Actions'];
    this.root = el('section', {id: 'sessions', class: 'panel', 'aria-labelledby': 'sessions-title'},
      el('header', {}, el('h2', {id: 'sessions-title'}, 'Sessions'), this.note,
        el('button', {class: 'quiet', type: 'button', onclick: () => void this.refresh()}, 'Read again')),
      el('div', {class: 'scroll'}, el('table', {}, el('thead', {}, el('tr', {}, ...heads.map(head => el('th', {scope: 'col'}, head)))), this.body)));
  }

  /** Read again when a recording, or another host's part of one, came, went or changed its state, or something was done to a session. */
  show(status: DaemonStatus): void {
    this.jobs = status.jobs;
    this.showJobs();
    const wanting = status.hosts.map(host => host.parts_wanting).join();
    const key = `${status.recording?.session} ${status.recording?.state} ${status.recording?.hosts.map(part => part.state).join()} ${wanting} ${status.jobs.map(job => `${job.kind} ${job.session}`).join()}`;
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
    for (const [session, row] of this.rows.views) row.showJobs(this.jobs.filter(job => job.session === session));
  }
}
