//! A terrace: a stone table on paving, a house, hedges and trees as far as forty units away, sky above hills.

use super::decor::{Decor, panel};
use crate::synth::scene::Body;
use crate::synth::scenes::surroundings::GROUND;
use crate::synth::texture::{Paint, Tiles};

/// Height of the paving [scene unit].
const FLOOR: f64 = GROUND - 3.0;
const LEAVES: [u32; 5] = [0x1d3a17, 0x2f5a22, 0x4b7a30, 0x7a9a45, 0xa9bf6a];

pub(super) fn bodies(d: &Decor) -> Vec<Body> {
    let mut all = ground(d);
    all.extend(house(d));
    all.extend(garden(d));
    all.extend(table(d));
    all
}

fn ground(d: &Decor) -> Vec<Body> {
    let paving = d.tiles(1, [1.3, 0.9], 0x4a4a42, &[0xb7ab98, 0xa39786, 0xc7bba6, 0x8e8477]);
    let stones = Tiles { shift: 0.5, ..paving };
    let terrace = panel([-9.0, -9.0], [9.0, 9.0], (0x8a8478, 0.4), Paint::Tiles(stones));
    let lawn = d.speckle(2, 2.5, &[0x3d5f24, 0x53772e, 0x6f9440, 0x8aa856]);
    vec![d.hung([-60.0, -60.0, FLOOR - 0.5], [60.0, 60.0, FLOOR], [0.0, 0.0, 1.0], lawn, vec![terrace])]
}

fn house(d: &Decor) -> Vec<Body> {
    let bricks =
        Tiles { shift: 0.5, ..d.tiles(10, [0.9, 0.32], 0xc9c0b0, &[0xa8523a, 0x96452f, 0xb8654a, 0x8a3d2b]) };
    let panes = || {
        Paint::Tiles(Tiles {
            joint: 0.14,
            ..d.tiles(11, [1.2, 1.5], 0xf2efe6, &[0x3f5a70, 0x6f93ad, 0x24394a])
        })
    };
    let window = |u: f64, v: f64| panel([u, v], [u + 2.6, v + 3.2], (0xf2efe6, 0.25), panes());
    let mut panels: Vec<_> =
        [-9.0, -4.5, 0.0, 4.5].iter().flat_map(|&u| [window(u, -1.6), window(u, 3.4)]).collect();
    panels.push(panel([-9.0, 2.1], [8.0, 3.0], (0x1d2d3a, 0.1), d.print(12, 0.85, [0xf0e6c8, 0x1d2d3a])));
    let awning = super::decor::stripes(0.8, &[0xf7f3e8, 0xc23b2e]);
    vec![
        d.hung([-11.0, 11.0, FLOOR], [11.0, 20.0, 8.0], [0.0, -1.0, 0.0], Paint::Tiles(bricks), panels),
        d.block("awning", [-5.0, 9.6, 3.0], [5.0, 11.0, 3.4], awning),
        d.hung(
            [-13.0, -12.0, FLOOR],
            [-12.0, 2.0, FLOOR + 4.4],
            [1.0, 0.0, 0.0],
            d.boards(13, [3.0, 0.5], &[0x7d6a55, 0x93806a, 0x6b5945]),
            vec![panel([-9.0, -2.2], [-2.5, 0.6], (0x333333, 0.15), d.print(14, 0.5, [0xf3ead0, 0x7a1f2b]))],
        ),
    ]
}

fn garden(d: &Decor) -> Vec<Body> {
    let tree = |k: u64, x: f64, y: f64, height: f64, radius: f64| {
        let bark = d.boards(20 + k, [0.4, 0.8], &[0x4b3a2a, 0x5d4a38]);
        let crown = d.speckle(30 + k, 0.8 * radius, &LEAVES);
        [
            d.can("trunk", [x, y], [FLOOR, height], 0.12 * radius, bark),
            d.ball("crown", [x, y, height + 0.6 * radius], radius, crown),
        ]
    };
    let hedge = |salt, min, max| d.block("hedge", min, max, d.speckle(salt, 0.9, &LEAVES));
    let mut all = vec![
        hedge(40, [12.0, -14.0, FLOOR], [14.0, 9.0, FLOOR + 3.4]),
        hedge(41, [-9.0, -17.0, FLOOR], [11.0, -15.0, FLOOR + 2.8]),
        d.can(
            "pot",
            [5.0, -6.5],
            [FLOOR, FLOOR + 1.4],
            0.9,
            d.motifs(42, 0.35, &[0xb5623c, 0xe8d3b0, 0x7f3f25]),
        ),
        d.ball(
            "bush",
            [5.0, -6.5, FLOOR + 2.2],
            1.2,
            d.speckle(43, 0.7, &[0x8a2f4a, 0x2f5a22, 0x4b7a30, 0xd96a8a]),
        ),
        d.can(
            "pot",
            [-6.5, -5.0],
            [FLOOR, FLOOR + 1.2],
            0.8,
            d.motifs(44, 0.3, &[0x2f6f8a, 0xf0e6d0, 0x1d3f5a]),
        ),
        d.ball(
            "bush",
            [-6.5, -5.0, FLOOR + 2.0],
            1.1,
            d.speckle(45, 0.6, &[0xd9a82f, 0x2f5a22, 0x4b7a30, 0xf2d86a]),
        ),
        d.block(
            "bench",
            [6.0, 3.0, FLOOR + 0.9],
            [8.0, 7.0, FLOOR + 1.2],
            d.boards(46, [3.0, 0.3], &[0x8a6a48, 0x75583a]),
        ),
    ];
    all.extend(tree(0, 20.0, -6.0, 2.0, 4.0));
    all.extend(tree(1, 16.0, -24.0, 3.0, 5.0));
    all.extend(tree(2, -8.0, -26.0, 2.5, 4.5));
    all.extend(tree(3, -24.0, -3.0, 3.5, 5.5));
    all.extend(tree(4, 24.0, 10.0, 3.0, 5.0));
    all
}

fn table(d: &Decor) -> Vec<Body> {
    let stone = d.speckle(50, 0.35, &[0x8d8578, 0xa89f90, 0xc4bba9, 0x77705f]);
    vec![
        d.can("table", [0.0, 0.0], [GROUND - 0.15, GROUND], 1.6, stone.clone()),
        d.can("foot", [0.0, 0.0], [FLOOR, GROUND - 0.15], 0.35, stone),
        d.block(
            "mosaic",
            [-0.9, -0.9, GROUND - 0.005],
            [0.9, 0.9, GROUND + 0.004],
            d.motifs(51, 0.14, &[0xf1ecdf, 0x1f5f7a, 0xd98f3d, 0x8f2d3a, 0x4b7a5a]),
        ),
        d.ball("orange", [1.2, 0.35, GROUND + 0.15], 0.15, d.speckle(52, 0.1, &[0xd97a1f, 0xf2a03a])),
        d.can("can", [-1.1, 0.6], [GROUND, GROUND + 0.5], 0.18, d.print(53, 0.09, [0x2f6f4a, 0xf7f0d8])),
    ]
}
