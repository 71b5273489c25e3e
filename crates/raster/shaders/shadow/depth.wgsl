// The nearest hair as a lamp sees it: depth alone.

@fragment
fn shadow_depth(v: HairVertex) {
}
