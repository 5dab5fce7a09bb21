//! Painted surfaces in the light of a lamp: what walls, furniture and ordinary things of a room show.
//!
//! The light is part of the colour: it depends on the place alone, so that a surface looks the same from everywhere.

use super::color::Rgb;
use super::paint::Paint;
use refraxel_core::{Vec3, vec3};

/// A small lamp and light from everywhere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lamp {
    /// Where it hangs [scene unit].
    pub at: Vec3<f64>,
    /// Light of the lamp on a face towards it at a distance of 1 [scene unit²].
    pub power: f64,
    /// Light from everywhere.
    pub ambient: f64,
}

impl Lamp {
    /// Lambert's law: light on a face at `x` with the unit normal `normal`; 1 shows paint in its own colour.
    fn on(&self, x: Vec3<f64>, normal: Vec3<f64>) -> f64 {
        let way = self.at - x;
        let squared = way.dot(way);
        self.ambient + self.power * (normal.dot(way) / squared.sqrt()).max(0.0) / squared
    }
}

/// How paint lies on a body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Face {
    /// On a plane that looks along this unit vector.
    Flat(Vec3<f64>),
    /// On the six sides of an axis-aligned box.
    Box {
        /// Middle [scene unit].
        center: Vec3<f64>,
        /// Half of each edge [scene unit].
        half: Vec3<f64>,
    },
    /// Around an upright axis: on balls, cups and other round things.
    Round {
        /// Middle [scene unit].
        center: Vec3<f64>,
        /// Distance of the axis at which the design has its own width [scene unit].
        radius: f64,
        /// Height of the flat ends above and below the middle [scene unit]; infinite where there are none.
        half: f64,
    },
}

impl Face {
    /// Coordinates of the design (to the right and upwards) and the normal at `x`.
    fn at(&self, x: Vec3<f64>) -> ([f64; 2], Vec3<f64>) {
        match *self {
            Face::Flat(normal) => (spread(x, normal), normal),
            Face::Box { center, half } => {
                let from = x - center;
                let out = |a: usize| from[a].abs() - half[a];
                let axis = (0..3).fold(0, |best, a| if out(a) > out(best) { a } else { best });
                let mut normal = Vec3::zero();
                normal[axis] = from[axis].signum();
                (spread(from, normal), normal)
            }
            Face::Round { center, radius, half } => {
                const ROUNDING: f64 = 1e-6; // scene unit
                let from = x - center;
                if from.z.abs() > half - ROUNDING {
                    return ([from.x, from.y], vec3(0.0, 0.0, from.z.signum()));
                }
                let around = from.y.atan2(from.x);
                ([around * radius, from.z], from.normalized())
            }
        }
    }
}

/// Coordinates on a plane, as somebody sees them who stands upright before it.
fn spread(x: Vec3<f64>, normal: Vec3<f64>) -> [f64; 2] {
    if normal.z.abs() > 0.5 {
        return [x.x, x.y];
    }
    let right = vec3(0.0, 0.0, 1.0).cross(normal);
    [x.dot(right), x.z]
}

/// A framed rectangle on a surface: a poster, a window, a cloth.
#[derive(Clone, Debug)]
pub struct Panel {
    /// Smallest coordinates of the design.
    pub min: [f64; 2],
    /// Largest coordinates of the design.
    pub max: [f64; 2],
    /// What it shows.
    pub paint: Paint,
    /// Colour and width [scene unit] of the frame within the rectangle.
    pub frame: (Rgb, f64),
}

impl Panel {
    fn color(&self, at: [f64; 2]) -> Option<Rgb> {
        let edge =
            (0..2).map(|a| (at[a] - self.min[a]).min(self.max[a] - at[a])).fold(f64::INFINITY, f64::min);
        (edge >= 0.0).then(|| if edge < self.frame.1 { self.frame.0 } else { self.paint.color(at) })
    }
}

/// Paint on a face, with panels on it, in the light of a lamp.
#[derive(Clone, Debug)]
pub struct Surface {
    /// How the paint lies.
    pub face: Face,
    /// The paint.
    pub paint: Paint,
    /// What hangs on it; the first one hides later ones.
    pub panels: Vec<Panel>,
    /// The light.
    pub lamp: Lamp,
}

impl Surface {
    pub(super) fn color(&self, x: Vec3<f64>) -> Rgb {
        let (at, normal) = self.face.at(x);
        let hung = self.panels.iter().find_map(|panel| panel.color(at));
        let light = self.lamp.on(x, normal);
        hung.unwrap_or_else(|| self.paint.color(at)).map(|c| (c * light).min(1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAMP: Lamp = Lamp { at: vec3(0.0, 0.0, 2.0), power: 4.0, ambient: 0.1 };

    #[test]
    fn light_falls_with_the_square_of_the_distance_and_the_cosine() {
        let up = vec3(0.0, 0.0, 1.0);
        assert_eq!(LAMP.on(Vec3::zero(), up), 1.1);
        assert!((LAMP.on(vec3(2.0, 0.0, 0.0), up) - (0.1 + 0.5_f64.sqrt() / 2.0)).abs() < 1e-12);
        assert_eq!(LAMP.on(Vec3::zero(), -up), 0.1);
    }

    #[test]
    fn a_panel_hides_the_paint_within_its_edges_only() {
        let panel = Panel {
            min: [-1.0, 0.0],
            max: [1.0, 1.0],
            paint: Paint::Plain([0.5; 3]),
            frame: ([0.25; 3], 0.1),
        };
        let lamp = Lamp { power: 0.0, ambient: 1.0, ..LAMP };
        let face = Face::Flat(vec3(0.0, -1.0, 0.0));
        let wall = Surface { face, paint: Paint::Plain([0.75; 3]), panels: vec![panel], lamp };
        let seen = |x: f64, z: f64| wall.color(vec3(x, 3.0, z))[0];
        assert_eq!([seen(0.0, 0.5), seen(0.95, 0.5), seen(1.1, 0.5)], [0.5, 0.25, 0.75]);
    }

    #[test]
    fn print_on_any_wall_runs_from_left_to_right() {
        for normal in [vec3(1.0, 0.0, 0.0), vec3(-1.0, 0.0, 0.0), vec3(0.0, 1.0, 0.0), vec3(0.0, -1.0, 0.0)] {
            let right = (-normal).cross(vec3(0.0, 0.0, 1.0));
            assert_eq!(Face::Flat(normal).at(right).0, [1.0, 0.0]);
        }
    }
}
