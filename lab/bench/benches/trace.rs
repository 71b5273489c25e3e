//! How many samples of pixels a second does the built-in scene give, on all threads?

use std::hint::black_box;

use bench::builtin;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use rayon::prelude::*;

fn samples(c: &mut Criterion) {
    let tracer = builtin();
    let film = tracer.scene().film;
    // Every eighth row: the whole picture's mixture of hair, head and sky.
    let rows: Vec<u32> = (0..film.height).step_by(8).collect();
    let mut group = c.benchmark_group("trace");
    group.sample_size(10);
    group.throughput(Throughput::Elements(rows.len() as u64 * u64::from(film.width)));
    let mut index = 0;
    group.bench_function("samples", |b| {
        b.iter(|| {
            index += 1;
            rows.par_iter().for_each(|&y| {
                for x in 0..film.width {
                    black_box(tracer.sample(x, y, index));
                }
            });
        });
    });
    group.finish();
}

criterion_group!(benches, samples);
criterion_main!(benches);
