//! Where the thing stands: a kitchen, a study or a terrace.

use super::decor::Decor;
use super::{kitchen, study, terrace};
use crate::synth::scene::{Body, Environment};
use crate::synth::scenes::surroundings::Setting;
use refraxel_core::vec3;

/// What stands around the thing.
#[derive(Clone, Copy)]
pub(super) enum Place {
    Kitchen,
    Study,
    Terrace,
}

impl Place {
    /// Light and colours, and between which azimuths there is room for a photographer [degree].
    pub(super) fn decor(self, setting: &Setting) -> (Decor, [f64; 2]) {
        match self {
            Place::Kitchen => (Decor::new(setting, vec3(0.9, -1.1, 3.6), 11.0, 0.34), [-165.0, -15.0]),
            Place::Study => (Decor::new(setting, vec3(-1.2, -0.8, 3.3), 9.0, 0.3), [-160.0, -20.0]),
            Place::Terrace => (Decor::new(setting, vec3(-30.0, -20.0, 50.0), 3000.0, 0.35), [0.0, 360.0]),
        }
    }

    pub(super) fn bodies(self, decor: &Decor) -> Vec<Body> {
        match self {
            Place::Kitchen => kitchen::bodies(decor),
            Place::Study => study::bodies(decor),
            Place::Terrace => terrace::bodies(decor),
        }
    }

    pub(super) fn environment(self, setting: &Setting) -> Environment {
        match self {
            Place::Kitchen | Place::Study => Environment::Constant([0.8; 3]),
            Place::Terrace => Environment::Landscape { seed: setting.salted(300) },
        }
    }
}
