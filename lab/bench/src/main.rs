//! Times the stages before the first sample of the built-in scene.
use std::sync::Arc;
use std::time::Instant;
fn main() {
    let t = Instant::now();
    let scene = job::load(&job::Source::Builtin, &[]).unwrap();
    println!("load {:?}", t.elapsed());
    let scene = Arc::new(scene);
    let t = Instant::now();
    let tracer = trace::Tracer::new(scene.clone(), Default::default());
    println!("tracer {:?} {:?}", t.elapsed(), tracer.accel().stats());
    let t = Instant::now();
    let strands: Vec<accel::Strands> = scene.grooms.iter().map(|g| accel::Strands { points: g.groom.points(), radii: g.groom.radius.as_deref().unwrap(), offsets: g.groom.offsets() }).collect();
    let a = accel::Accel::build(&strands, &[], &accel::Options::default());
    println!("strands only {:?} {:?}", t.elapsed(), a.stats());
    let t = Instant::now();
    let a = accel::Accel::build(&strands, &[], &accel::Options { basis: accel::Basis::Linear, ..Default::default() });
    println!("linear {:?} {:?}", t.elapsed(), a.stats());
}
