//! A study: a desk before shelves of books, posters of printed text, a window.

use super::decor::{Decor, panel};
use crate::synth::scene::Body;
use crate::synth::scenes::surroundings::GROUND;
use crate::synth::texture::{Paint, Panel, Tiles};

/// Height of the floor [scene unit].
const FLOOR: f64 = GROUND - 3.0;
const TOP: f64 = 6.0;

pub(super) fn bodies(d: &Decor) -> Vec<Body> {
    let mut all = walls(d);
    all.extend(furniture(d));
    all.extend(on_the_desk(d));
    all
}

fn walls(d: &Decor) -> Vec<Body> {
    let plaster = |salt| d.speckle(salt, 0.9, &[0x8a9a86, 0x97a792, 0xa3b29d]);
    vec![
        d.wall(
            [-5.0, 4.6, FLOOR],
            [5.0, 5.4, TOP],
            [0.0, -1.0, 0.0],
            Paint::Books { shelf: 1.25, seed: d.seed(1) },
        ),
        d.hung([-5.4, -5.4, FLOOR], [-5.0, 5.4, TOP], [1.0, 0.0, 0.0], plaster(2), posters(d)),
        d.hung([5.0, -5.4, FLOOR], [5.4, 5.4, TOP], [-1.0, 0.0, 0.0], plaster(3), maps(d)),
        d.hung([-5.0, -5.4, FLOOR], [5.0, -5.0, TOP], [0.0, 1.0, 0.0], plaster(4), window(d)),
        d.hung(
            [-5.4, -5.4, FLOOR - 0.4],
            [5.4, 5.4, FLOOR],
            [0.0, 0.0, 1.0],
            d.boards(5, [2.6, 0.42], &[0x7b5433, 0x8f6540, 0x6a4628]),
            vec![panel(
                [-3.5, -3.0],
                [3.5, 3.0],
                (0x6d1f2a, 0.25),
                d.motifs(6, 0.5, &[0x8f2d3a, 0xd9b36a, 0x23395b, 0xe9dcc0]),
            )],
        ),
        d.wall([-5.4, -5.4, TOP], [5.4, 5.4, TOP + 0.4], [0.0, 0.0, -1.0], Paint::Plain([0.75, 0.73, 0.68])),
    ]
}

fn posters(d: &Decor) -> Vec<Panel> {
    vec![
        panel([-3.9, -0.4], [-1.7, 2.9], (0x1f1f1f, 0.05), d.print(10, 0.42, [0xf4f0e4, 0xb3202c])),
        panel([-1.2, 0.1], [0.9, 2.9], (0xd9d2c0, 0.1), d.print(11, 0.17, [0xfaf7ee, 0x16202b])),
        panel([1.4, -0.2], [3.9, 2.6], (0x2b3a4a, 0.07), d.print(12, 0.27, [0x1d3557, 0xf1c453])),
        panel([-3.9, -3.4], [3.9, -0.8], (0x3a2618, 0.1), Paint::Books { shelf: 1.2, seed: d.seed(13) }),
    ]
}

fn maps(d: &Decor) -> Vec<Panel> {
    let map = &[0x2b5f8a, 0x3f7fae, 0xd8c690, 0x8fae6a, 0x5f8a4f, 0xf3efe0];
    vec![
        panel([-3.4, 0.0], [0.4, 2.8], (0x6b4a2f, 0.1), d.speckle(20, 1.1, map)),
        panel([1.0, 0.2], [3.4, 2.6], (0x222222, 0.06), d.print(21, 0.22, [0xeef2ea, 0x234f3a])),
        panel([-3.9, -3.4], [3.9, -0.8], (0x3a2618, 0.1), Paint::Books { shelf: 1.0, seed: d.seed(22) }),
    ]
}

fn window(d: &Decor) -> Vec<Panel> {
    let panes = Tiles { joint: 0.1, ..d.tiles(30, [1.1, 1.4], 0xece6da, &[0xe8f4ff, 0xd2e9fb, 0xbcdcf5]) };
    vec![
        panel([-2.2, 0.0], [2.2, 4.2], (0xece6da, 0.15), Paint::Tiles(panes)),
        panel([-4.4, -0.4], [-2.7, 2.6], (0x1f1f1f, 0.05), d.print(31, 0.3, [0xf7e8c8, 0x3a2d6b])),
    ]
}

fn furniture(d: &Decor) -> Vec<Body> {
    let pillar = |x: f64| {
        d.block(
            "pillar",
            [x - 0.1, 4.3, FLOOR],
            [x + 0.1, 4.7, TOP],
            d.boards(40, [0.2, 2.0], &[0x4a2f1b, 0x5a3a22]),
        )
    };
    let drawers = Tiles { joint: 0.06, ..d.tiles(41, [1.2, 0.7], 0x2a1a10, &[0x6a4424, 0x744c2a]) };
    vec![
        d.block(
            "desk",
            [-1.9, -1.3, GROUND - 0.14],
            [1.9, 1.3, GROUND],
            d.boards(42, [2.4, 0.6], &[0x7a4a28, 0x8a5730, 0x6c4020]),
        ),
        d.block("drawers", [-1.8, -1.1, FLOOR], [-0.7, 1.1, GROUND - 0.14], Paint::Tiles(drawers.clone())),
        d.block("drawers", [0.7, -1.1, FLOOR], [1.8, 1.1, GROUND - 0.14], Paint::Tiles(drawers)),
        pillar(-2.5),
        pillar(0.0),
        pillar(2.5),
    ]
}

fn on_the_desk(d: &Decor) -> Vec<Body> {
    let book = |salt: u64, min: [f64; 3], max: [f64; 3], display| {
        d.block("book", min, max, d.print(salt, 0.085, display))
    };
    vec![
        d.block(
            "newspaper",
            [-0.8, -0.7, GROUND - 0.005],
            [0.95, 0.75, GROUND + 0.004],
            d.print(50, 0.1, [0xe6e1d3, 0x23262b]),
        ),
        book(51, [-1.5, 0.55, GROUND], [-0.85, 1.05, GROUND + 0.13], [0x7b1e2b, 0xf2d8a0]),
        book(52, [-1.45, 0.5, GROUND + 0.13], [-0.9, 1.0, GROUND + 0.24], [0x1f4d5c, 0xf5f0e0]),
        book(53, [-1.4, 0.6, GROUND + 0.24], [-0.92, 1.02, GROUND + 0.38], [0xd9a441, 0x2a2a2a]),
        d.ball(
            "globe",
            [1.3, 0.8, GROUND + 0.42],
            0.3,
            d.speckle(54, 0.25, &[0x1f5f99, 0x2f7fbf, 0x4f8f4a, 0xd8c48a]),
        ),
        d.can(
            "foot",
            [1.3, 0.8],
            [GROUND, GROUND + 0.14],
            0.16,
            d.boards(55, [0.3, 0.05], &[0x5a3a22, 0x6a4628]),
        ),
        d.can(
            "pencils",
            [1.35, -0.45],
            [GROUND, GROUND + 0.35],
            0.13,
            d.motifs(56, 0.09, &[0xf2b632, 0x1b3a57, 0xe0562b]),
        ),
    ]
}
