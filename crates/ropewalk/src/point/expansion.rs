//! Signs of sums and products without any rounding.
//!
//! A sum is kept as an expansion: numbers that do not overlap, the largest last, so that its sign is
//! that of the last one which is not zero (Shewchuk, "Adaptive Precision Floating-Point Arithmetic
//! and Fast Robust Geometric Predicates", 1997).

/// A sum of at most `N` terms.
pub struct Expansion<const N: usize> {
    parts: [f64; N],
    len: usize,
}

impl<const N: usize> Expansion<N> {
    /// Nothing.
    pub fn new() -> Self {
        Expansion { parts: [0.0; N], len: 0 }
    }

    /// Adds a number (Grow-Expansion); parts that vanish are left out.
    pub fn add(&mut self, term: f64) {
        if term == 0.0 {
            return;
        }
        let (mut sum, mut kept) = (term, 0);
        for i in 0..self.len {
            // Two-Sum: `total + error` is `sum + part` exactly.
            let part = self.parts[i];
            let total = sum + part;
            let virtual_part = total - sum;
            let error = (sum - (total - virtual_part)) + (part - virtual_part);
            if error != 0.0 {
                self.parts[kept] = error;
                kept += 1;
            }
            sum = total;
        }
        if sum != 0.0 {
            self.parts[kept] = sum;
            kept += 1;
        }
        self.len = kept;
    }

    /// Adds a product; neither it nor its rounding error may underflow.
    pub fn add_product(&mut self, x: f64, y: f64) {
        let product = x * y;
        self.add(product);
        self.add(x.mul_add(y, -product));
    }

    /// Adds a product of three; neither it nor any rounding error may underflow.
    pub fn add_product_of_three(&mut self, x: f64, y: f64, z: f64) {
        let product = x * y;
        self.add_product(product, z);
        self.add_product(x.mul_add(y, -product), z);
    }

    /// -1, 0 or 1.
    pub fn sign(&self) -> i32 {
        if self.len == 0 { 0 } else { sign(self.parts[self.len - 1]) }
    }
}

/// -1, 0 or 1.
pub fn sign(x: f64) -> i32 {
    i32::from(x > 0.0) - i32::from(x < 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_is_rounded_away() {
        let mut sum = Expansion::<8>::new();
        for term in [1e100, 1.0, 1e-100, -1e100, -1.0] {
            sum.add(term);
        }
        assert_eq!(sum.sign(), 1);
        sum.add(-1e-100);
        assert_eq!(sum.sign(), 0);
        // (1 + e)^2 - (1 + 2 e) is e^2.
        let e = f64::EPSILON;
        let mut square = Expansion::<8>::new();
        square.add_product(1.0 + e, 1.0 + e);
        square.add(-(1.0 + 2.0 * e));
        assert_eq!(square.sign(), 1);
        square.add_product(-e, e);
        assert_eq!(square.sign(), 0);
        // (1 + e)^3 is 1 + 3 e + 3 e^2 + e^3.
        let mut cube = Expansion::<12>::new();
        cube.add_product_of_three(1.0 + e, 1.0 + e, 1.0 + e);
        cube.add(-(1.0 + 2.0 * e));
        cube.add(-e);
        cube.add_product(-3.0 * e, e);
        assert_eq!(cube.sign(), 1);
        cube.add_product(-e * e, e);
        assert_eq!(cube.sign(), 0);
    }
}
