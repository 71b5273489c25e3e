//! How many samples of pixels a second does the built-in scene give, on all threads? One pass over the whole
//! picture, as a render makes it.

use std::sync::atomic::AtomicBool;

use bench::builtin;
use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use film::Film;

fn samples(c: &mut Criterion) {
    let tracer = builtin();
    let settings = tracer.scene().film;
    let mut film = Film::new(settings.width, settings.height).expect("the built-in picture fits into memory");
    let mut group = c.benchmark_group("trace");
    group.sample_size(10);
    group.throughput(Throughput::Elements(u64::from(settings.width) * u64::from(settings.height)));
    let mut index = 0;
    group.bench_function("samples", |b| {
        b.iter(|| {
            tracer.render(&mut film, index, index + 1, &AtomicBool::new(false));
            index += 1;
        });
    });
    group.finish();
}

criterion_group!(benches, samples);
criterion_main!(benches);
