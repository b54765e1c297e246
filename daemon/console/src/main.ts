// SPDX-License-Identifier: Apache-2.0
// The page: one part for each thing the operator minds, all shown from the daemon's status as it comes.
import './style.css';

import {Alignment} from './alignment';
import {Bar} from './bar';
import {Cameras} from './cameras';
import {complaints, connected, heard} from './complaints';
import {diagnostics} from './diagnostics';
import {el, set, setText} from './dom';
import {fixed} from './format';
import {Header} from './header';
import {Hosts} from './hosts';
import {Journal} from './journal';
import {Keys} from './keys';
import {Link} from './link';
import {Record} from './record';
import {Reconstruction} from './reconstruction';
import {Sessions} from './sessions';
import {Strobe} from './strobe';
import {Stylization} from './stylize/stylization';
import {Token} from './token';

const header = new Header();
const cameras: Cameras = new Cameras(wanted => link.watch(wanted));
const record = new Record();
const alignment = new Alignment();
const hosts = new Hosts();
const strobe = new Strobe();
const reconstruction = new Reconstruction();
const stylization = new Stylization();
const sessions = new Sessions();
const journal = new Journal();
const token = new Token(word => link.unlock(word));
const figures = el('span', {id: 'diagnostics'});
const bar = new Bar([record.hint, record.button, alignment.stop]);
const goTo = (id: string) => () => document.getElementById(id)?.scrollIntoView();
const keys = new Keys([
  {key: 'n', words: 'to the camera that is to be reset', run: () => cameras.focusNext()},
  {key: 'a', words: 'align; while aligned twice: stop', run: () => alignment.key()},
  {key: 'r', words: 'twice within 5 s: record, or stop recording', run: () => record.press('key')},
  {key: '1', words: 'cameras', run: () => scrollTo({top: 0})},
  {key: '2', words: 'reconstruction', run: goTo('reconstruction')},
  {key: '3', words: 'sessions', run: goTo('sessions')},
  {key: '4', words: 'journal', run: goTo('journal')},
  {key: '5', words: 'stylization', run: goTo('stylization')},
]);

document.body.append(
  header.root, bar.root,
  el('main', {},
    el('div', {class: 'rig-view'}, cameras.root, el('aside', {}, record.root, hosts.root, alignment.root, strobe.root)),
    stylization.root, reconstruction.root, sessions.root, journal.root),
  el('footer', {}, figures, el('button', {class: 'quiet', type: 'button', onclick: () => keys.help.showModal()}, 'Keys: ?')),
  cameras.enlarged.root, keys.help, token.root, complaints);

// What scrolls stops below the header, however many faults that names.
new ResizeObserver(() => document.documentElement.style.setProperty('--header', `${header.root.offsetHeight}px`)).observe(header.root);

const link: Link = new Link({
  connection(state) {
    header.connection(state);
    bar.connection(state);
    if (state === 'token') token.ask();
    if (state !== 'open') return;
    token.close();
    connected();
    diagnostics.forget();
    cameras.restart();
    journal.clear();
  },
  status(status) {
    diagnostics.heard(status.now_ns);
    heard(status);
    const {phase, recording} = status;
    set(document.documentElement, 'data-filmed', phase === 'CAPTURING' || phase === 'FINISHING' ? recording?.purpose : undefined);
    for (const part of [header, bar, cameras, record, alignment, hosts, strobe, stylization, reconstruction, sessions]) part.show(status);
  },
  notice: notice => journal.add(notice),
  iteration(preview) {
    stylization.preview(preview);
    reconstruction.preview(preview);
  },
  bytes(head, bytes) {
    if (head.kind === 'picture') cameras.offer(head, bytes);
    else if (head.kind === 'volume') {
      stylization.volume(head);
      reconstruction.showVolume(head, bytes);
    } else {
      stylization.picture(head, bytes);
      void reconstruction.view(head, bytes);
    }
  },
});

setInterval(() => {
  const {cameras: live, fps_min, fps_mean, latency_median_ms, latency_p95_ms} = diagnostics.summary();
  setText(figures, live === 0 ? 'no live pictures'
    : `${live} live · ${fixed(fps_mean, 1)} fps (least ${fixed(fps_min, 1)}) · frame to screen ${fixed(latency_median_ms, 0)} ms (95 %: ${fixed(latency_p95_ms, 0)} ms)`);
}, 1000);
