// The largest weight T a of the samples around each voxel. Weights are not negative, so their order is that of their bits.

fn weigh_sample(s: ptr<function, Sample>) {
    let bits = bitcast<u32>((*s).before * (*s).alpha);
    for (var k = 0u; k < 8u; k++) {
        weigh(corner_of((*s).slot, (*s).local, k), bits);
    }
}

fn weigh(voxel: u32, bits: u32) {
    if (atomicLoad(&weights[voxel]) < bits) {
        atomicMax(&weights[voxel], bits);
    }
}
