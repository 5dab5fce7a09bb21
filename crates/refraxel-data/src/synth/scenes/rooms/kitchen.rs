//! A kitchen: a table of boards, walls of tiles and striped paper, a window, cupboards.

use super::decor::{Decor, panel, stripes};
use crate::synth::scene::Body;
use crate::synth::scenes::surroundings::GROUND;
use crate::synth::texture::{Paint, Panel, Tiles};

/// Height of the floor [scene unit].
const FLOOR: f64 = GROUND - 3.0;
const TOP: f64 = 6.0;

pub(super) fn bodies(d: &Decor) -> Vec<Body> {
    let mut all = walls(d);
    all.extend(furniture(d));
    all.extend(on_the_table(d));
    all
}

fn walls(d: &Decor) -> Vec<Body> {
    let azulejos = d.tiles(1, [0.62, 0.62], 0xd8d4c8, &[0xf3f0e6, 0xe9efe9, 0xdfe9f2, 0xf3f0e6, 0x8db3c9]);
    let floor = d.tiles(2, [0.9, 0.9], 0x4c4640, &[0xb98d5e, 0xe8dcc4, 0x6f4a32]);
    vec![
        d.hung(
            [-5.0, 5.0, FLOOR],
            [5.0, 5.4, TOP],
            [0.0, -1.0, 0.0],
            Paint::Tiles(azulejos),
            over_the_stove(d),
        ),
        d.hung([-5.4, -5.4, FLOOR], [-5.0, 5.4, TOP], [1.0, 0.0, 0.0], paper(), pictures(d)),
        d.hung([5.0, -5.4, FLOOR], [5.4, 5.4, TOP], [-1.0, 0.0, 0.0], paper(), window(d)),
        d.hung([-5.0, -5.4, FLOOR], [5.0, -5.0, TOP], [0.0, 1.0, 0.0], paper(), calendar(d)),
        d.wall([-5.4, -5.4, FLOOR - 0.4], [5.4, 5.4, FLOOR], [0.0, 0.0, 1.0], Paint::Tiles(floor)),
        d.wall(
            [-5.4, -5.4, TOP],
            [5.4, 5.4, TOP + 0.4],
            [0.0, 0.0, -1.0],
            d.boards(3, [3.0, 0.5], &[0xe6e0d4, 0xd9d2c4]),
        ),
    ]
}

fn paper() -> Paint {
    stripes(0.17, &[0xe9d8b4, 0xc9744f, 0xe9d8b4, 0x5f7f74, 0xe9d8b4, 0xd9b36a])
}

fn over_the_stove(d: &Decor) -> Vec<Panel> {
    vec![
        panel([-3.6, 0.6], [-1.3, 2.6], (0x6b4a2f, 0.08), d.print(10, 0.28, [0xf6f1df, 0x7a1f1f])),
        panel(
            [1.2, 0.4],
            [3.9, 2.5],
            (0x2f3b45, 0.07),
            d.motifs(11, 0.42, &[0xf2c14e, 0xd1495b, 0x2e6f7e, 0xf7f1e3]),
        ),
        panel(
            [-0.9, 0.9],
            [0.8, 2.1],
            (0x8c6a3f, 0.06),
            d.speckle(12, 0.7, &[0x24466b, 0x6fa3c7, 0xe9e4cf, 0x5d7a3a]),
        ),
        panel(
            [-5.0, -0.75],
            [5.0, -0.35],
            (0x1f4e63, 0.05),
            d.motifs(13, 0.2, &[0x1f4e63, 0xf3efe2, 0xd98f3d]),
        ),
    ]
}

fn pictures(d: &Decor) -> Vec<Panel> {
    vec![
        panel([-3.8, 0.2], [-1.6, 3.0], (0x2b2b2b, 0.06), d.print(20, 0.2, [0xf4efe2, 0x20303f])),
        panel(
            [-1.0, 0.6],
            [1.2, 2.4],
            (0xa98243, 0.12),
            d.speckle(21, 0.5, &[0x3a2f55, 0xd96c5f, 0xf1d9a0, 0x52796f]),
        ),
        panel(
            [1.8, 0.0],
            [3.8, 2.8],
            (0x3c5a4a, 0.09),
            d.motifs(22, 0.33, &[0xf7f3e8, 0x264653, 0xe76f51, 0x2a9d8f]),
        ),
    ]
}

fn window(d: &Decor) -> Vec<Panel> {
    let panes = Tiles { joint: 0.12, ..d.tiles(30, [1.5, 1.6], 0xf5f2ea, &[0xdff0ff, 0xc9e6ff, 0xf2f8ff]) };
    vec![
        panel([-2.2, 0.0], [2.3, 3.4], (0xf5f2ea, 0.18), Paint::Tiles(panes)),
        panel([2.7, -0.2], [4.4, 2.2], (0x503a2a, 0.07), d.print(31, 0.34, [0x27455c, 0xf0d58a])),
    ]
}

fn calendar(d: &Decor) -> Vec<Panel> {
    let month = d.tiles(40, [0.4, 0.32], 0x333333, &[0xffffff, 0xf2f2f2, 0xe0574f]);
    vec![
        panel([-1.4, 0.0], [1.4, 2.24], (0x222222, 0.05), Paint::Tiles(month)),
        panel([-4.0, -0.2], [-2.0, 2.4], (0x6b4a2f, 0.08), d.print(41, 0.24, [0xe8efe0, 0x1d3b2a])),
    ]
}

fn furniture(d: &Decor) -> Vec<Body> {
    let leg = |x: f64, y: f64| {
        d.block(
            "leg",
            [x - 0.12, y - 0.12, FLOOR],
            [x + 0.12, y + 0.12, GROUND - 0.16],
            Paint::Plain([0.2, 0.1, 0.05]),
        )
    };
    let doors = Tiles { joint: 0.05, ..d.tiles(50, [1.4, 2.2], 0x2b3a3f, &[0x7fa08f, 0x8fae9c, 0x6f9080]) };
    vec![
        d.block(
            "table",
            [-1.7, -1.25, GROUND - 0.16],
            [1.7, 1.25, GROUND],
            d.boards(51, [1.9, 0.36], &[0xb07a45, 0x9c6536, 0xc48f57, 0x87552c]),
        ),
        leg(-1.5, -1.05),
        leg(1.5, -1.05),
        leg(-1.5, 1.05),
        leg(1.5, 1.05),
        d.block("cupboard", [-4.9, 3.7, FLOOR], [4.9, 4.95, GROUND - 0.6], Paint::Tiles(doors)),
        d.can(
            "pot",
            [-2.4, 4.2],
            [GROUND - 0.6, GROUND + 0.2],
            0.5,
            d.motifs(52, 0.25, &[0xb33a3a, 0xf2e9d8, 0x8a2a2a]),
        ),
        d.can("jar", [2.2, 4.3], [GROUND - 0.6, GROUND + 0.5], 0.38, d.print(53, 0.16, [0xf1ead6, 0x2a5a3a])),
    ]
}

fn on_the_table(d: &Decor) -> Vec<Body> {
    vec![
        d.block(
            "cloth",
            [-0.85, -0.75, GROUND - 0.005],
            [0.85, 0.75, GROUND + 0.004],
            d.motifs(60, 0.15, &[0xf4efe6, 0x1b3a57, 0xe0562b, 0x2f9e8f, 0xf2b632]),
        ),
        d.can("tin", [-1.1, 0.85], [GROUND, GROUND + 0.62], 0.2, d.print(61, 0.09, [0xd9362b, 0xfdf6e3])),
        d.can(
            "cup",
            [1.15, 0.6],
            [GROUND, GROUND + 0.34],
            0.17,
            stripes(0.05, &[0xf7f3ea, 0x2b5f8a, 0xf7f3ea]),
        ),
        d.ball(
            "apple",
            [1.05, -0.62, GROUND + 0.16],
            0.16,
            d.speckle(62, 0.2, &[0x9c1c1c, 0xc93a2b, 0xe0a030]),
        ),
        d.ball("lemon", [-1.2, -0.3, GROUND + 0.13], 0.13, d.speckle(63, 0.1, &[0xd9b01f, 0xf2d24a])),
        d.block(
            "box",
            [0.5, 0.95, GROUND],
            [1.0, 1.15, GROUND + 0.75],
            d.print(64, 0.11, [0x2a6f77, 0xfbe9b7]),
        ),
    ]
}
