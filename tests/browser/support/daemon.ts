// SPDX-License-Identifier: Apache-2.0
// emberlockd in a folder of its own, on a free port of this machine.
import {type ChildProcess, execFileSync, spawn} from 'node:child_process';
import {randomBytes} from 'node:crypto';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {createServer} from 'node:net';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

import type {DaemonStatus} from '../../../daemon/console/src/api.gen';
import {decode} from '../../../daemon/console/src/wire';
import {until} from './chromium';

async function freePort(): Promise<number> {
  return new Promise(resolve => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const {port} = server.address() as {port: number};
      server.close(() => resolve(port));
    });
  });
}

/** The configuration's part of a rig of virtual cameras that film a flame, and their strobe. */
export const virtualRig = (name: string, cameras: number, size: string): string => `
[rig]
name = "${name}"
[rig.virtual]
scene = "flame"
seed = 1
[[rig.camera]]
driver = "virtual"
count = ${cameras}
size = "${size}"
[rig.strobe]
driver = "virtual"
`;

export class Daemon {
  /** Where it keeps what it records, and beside that what it reconstructs. */
  readonly folder = mkdtempSync(join(tmpdir(), 'emberlock-walk-'));
  private child?: ChildProcess;
  private said = '';
  private ended = false;
  readonly token = randomBytes(32).toString('hex');
  private bin = '';
  url = '';

  /** `rig` is the configuration's part that tells of cameras and strobe; `voxels` those of reconstructions. What an earlier one recorded is still there. */
  async start(bin: string, console: string, rig: string, voxels = 48): Promise<void> {
    const port = await freePort();
    this.bin = bin;
    this.ended = false;
    writeFileSync(join(this.folder, 'token'), this.token, {mode: 0o600});
    this.url = `http://127.0.0.1:${port}/`;
    const configuration = join(this.folder, 'emberlock.toml');
    writeFileSync(configuration, `${rig}
[recording]
folder = "${this.folder}/sessions"
[reconstruction]
program = "${bin}/emberlock"
voxels = ${voxels}
[server]
socket = "${this.folder}/emberlockd.sock"
http_listen = "127.0.0.1:${port}"
token_file = "${this.folder}/token"
console = "${console}"
`);
    // It goes with whoever runs the tests, even where that is killed.
    this.child = spawn('setpriv', ['--pdeathsig', 'KILL', `${bin}/emberlockd`, '--config', configuration], {stdio: ['ignore', 'pipe', 'pipe']});
    for (const stream of [this.child.stdout!, this.child.stderr!]) stream.on('data', (data: Buffer) => { this.said += data.toString(); });
    this.child.on('exit', () => { this.ended = true; });
    const ready = () => fetch(`${this.url}healthz`).then(answer => answer.ok, () => false);
    await until(async () => this.ended || (await ready()), Boolean, 'emberlockd answers');
    if (this.ended) throw new Error(`emberlockd ended: ${this.said}`);
  }

  /** As an operator gets one: what `emberlock console` prints. */
  link(): string {
    return execFileSync(`${this.bin}/emberlock`, ['console', '--daemon', `unix:${this.folder}/emberlockd.sock`], {stdio: ['ignore', 'pipe', 'ignore']}).toString().trim();
  }

  async call<T>(method: string, request: object = {}): Promise<T> {
    const answer = await fetch(`${this.url}api/v1/${method}`, {method: 'POST', headers: {'Content-Type': 'application/json', Authorization: `Bearer ${this.token}`}, body: JSON.stringify(request)});
    if (!answer.ok) throw new Error(`${method}: ${await answer.text()}`);
    return (await answer.json()) as T;
  }

  async status(): Promise<DaemonStatus> {
    return decode('DaemonStatus', await this.call('Daemon/GetStatus')) as DaemonStatus;
  }

  get log(): string {
    return this.said;
  }

  kill(): void {
    this.child?.kill('SIGKILL');
  }

  /** As an operator ends it; what was recorded stays. */
  async end(): Promise<void> {
    if (!this.child || this.ended) return;
    this.child.kill('SIGTERM');
    await until(() => this.ended, Boolean, 'emberlockd ended').catch(() => this.kill());
  }

  async stop(): Promise<void> {
    await this.end();
    rmSync(this.folder, {recursive: true, force: true});
  }
}
