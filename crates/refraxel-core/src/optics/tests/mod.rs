//! Proofs on paths: closed forms of optics, gradients against central differences, and derivatives against Snell's law.

mod absorbing;
mod glass_ball;
mod graded_bodies;
mod gradients;
mod lenses;
mod measures;
mod mirrors;
mod nested;
mod nested_gradients;
mod paths;
mod predictions;
mod scene;
mod sharp;
mod sharp_gradients;
mod snell;
