// SPDX-License-Identifier: Apache-2.0
// How tiles are laid out so that pictures get the most room: so many columns, and words below a picture or beside it.

export interface Arrangement {
  columns: number;
  beside: boolean;
}

const kLowest = 92;               // px of height that they need there, at least (style.css leaves some out where it's that low)
const kNarrowest = 160;           // px of width of a tile whose words are below
const kBorder = 4;                // px of a tile, both sides
const kMostColumns = 8;           // as style.css has

/** px that a tile's words need below its picture: the narrower it is, the more lines they take. */
export function wordsBelow(width: number): number {
  return width < 230 ? 166 : width < 340 ? 118 : 134;
}

/** px that they need beside it: the higher it is, the larger they are (style.css: 8 % of the height, 12 to 15 px). */
export function wordsBeside(height: number): number {
  return 12 * Math.max(12, Math.min(15, 0.08 * height));
}

/** Width in px of a picture of this aspect, and which part of the side that it leans on it fills. */
export function pictureIn(width: number, height: number, aspect: number, beside: boolean): {width: number; fills: number} {
  const [w, h] = beside ? [width - kBorder - wordsBeside(height), height - kBorder] : [width - kBorder, height - kBorder - wordsBelow(width)];
  if (w <= 0 || h <= 0 || (beside ? h < kLowest : width < kNarrowest)) return {width: 0, fills: 0};
  const shown = Math.min(w, h * aspect);
  return {width: shown, fills: beside ? shown / aspect / h : shown / w};
}

/** The largest pictures of this aspect for `cells` tiles in width x height. One that leaves part of its side empty counts for less. */
export function arrange(cells: number, width: number, height: number, aspect: number, gap = 8): Arrangement {
  let best: Arrangement = {columns: 1, beside: false};
  let most = -1;
  for (let columns = 1; columns <= Math.min(cells, kMostColumns); ++columns) {
    const rows = Math.ceil(cells / columns);
    for (const beside of [false, true]) {
      const picture = pictureIn((width - gap * (columns - 1)) / columns, (height - gap * (rows - 1)) / rows, aspect, beside);
      const worth = picture.width * (0.7 + 0.3 * picture.fills);
      if (worth <= most) continue;
      most = worth;
      best = {columns, beside};
    }
  }
  return best;
}
