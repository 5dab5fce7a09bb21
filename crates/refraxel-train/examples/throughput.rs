//! `cargo run --release --example throughput`: samples per second of the CPU backend.
#![allow(clippy::print_stdout)]
fn main() {
    let o = refraxel_train::bench::BenchOptions { resolution: 128, rays: 16384, repetitions: 5 };
    println!("{:#?}", refraxel_train::bench::straight(&o));
}
