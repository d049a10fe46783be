// Arithmetic as fast as it comes: products and sums may be fused and reordered, quotients and roots a little off.

fn add(a: f32, b: f32) -> f32 {
    return a + b;
}

fn sub(a: f32, b: f32) -> f32 {
    return a - b;
}

fn mul(a: f32, b: f32) -> f32 {
    return a * b;
}

fn div(a: f32, b: f32) -> f32 {
    return a / b;
}

fn root(value: f32) -> f32 {
    return sqrt(value);
}
