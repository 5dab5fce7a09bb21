//! `cargo run --release --example throughput`: samples per second of the CPU backend.
#![allow(clippy::print_stdout)]
fn main() {
    let n = std::env::args().nth(1).and_then(|a| a.parse().ok()).unwrap_or(10);
    let o = refraxel_train::bench::BenchOptions { resolution: 128, rays: 16384, repetitions: n };
    println!("{:#?}", refraxel_train::bench::straight(&o));
}
