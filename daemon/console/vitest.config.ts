// SPDX-License-Identifier: Apache-2.0
import {fileURLToPath} from 'node:url';

import {defineConfig} from 'vitest/config';

const project = fileURLToPath(new URL('../..', import.meta.url));
const modules = fileURLToPath(new URL('node_modules/', import.meta.url));

// The tests lie in tests/browser, as all do, and use what is installed here.
export default defineConfig({
  root: project,
  cacheDir: `${modules}.vite`,
  server: {fs: {allow: [project]}},
  resolve: {
    alias: [
      {find: /^vitest$/, replacement: `${modules}vitest/dist/index.js`},
      {find: /^ws$/, replacement: `${modules}ws/wrapper.mjs`},
      {find: /^playwright-core$/, replacement: `${modules}playwright-core/index.mjs`},
    ],
  },
  test: {include: ['tests/browser/**/*.test.ts'], fileParallelism: false, testTimeout: 900_000, hookTimeout: 900_000},
});
