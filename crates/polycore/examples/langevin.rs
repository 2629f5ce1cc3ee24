//! The Langevin function, its exact inverse, and what an approximant of the literature makes of it.

use polycore::langevin::{Inverse, inverse, inverse_from_complement, langevin};

fn main() {
    println!("       x              L^-1(x)   L(β) − x   relative errors of approximants");
    for x in [0.1, 0.5, 0.9, 0.99] {
        let beta = inverse(x);
        let error = |choice: Inverse| format!("{} {:+.1e}", choice.name(), choice.value(x) / beta - 1.0);
        let approximants: Vec<String> = Inverse::ALL.into_iter().skip(1).take(3).map(error).collect();
        println!("{x:>8} {beta:>20.16} {:>10.1e}   {}", langevin(beta) - x, approximants.join(", "));
    }
    // near the locking point the digits are in 1 − x
    println!("chain at 1 − 1e-12 of its length: β = {:.6e}", inverse_from_complement(1e-12));
}
