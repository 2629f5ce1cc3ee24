//! Bond laws side by side: tension, tangent at rest, and the stretch of the largest force of a chain.

use peri::potential::{Chain, Law};

pub(crate) fn main() -> Result<(), peri::Error> {
    let (links, dissociation) = (720.0, 1200.0);
    println!("{:<14} {:>8} {:>9} {:>9} {:>9}", "law", "t′(1)", "t(1.2)", "t(2)", "t(2.94)");
    for law in Law::ALL {
        let bond = law.build(links, dissociation, false)?;
        let [a, b, c] = [1.2, 2.0, 2.94].map(|stretch| bond.tension(stretch));
        println!("{:<14} {:>8.4} {a:>9.4} {b:>9.4} {c:>9.4}", law.name(), bond.tangent());
    }
    // beyond its greatest force a chain softens: its links break
    let strongest = Chain::new(links, dissociation)?.strongest();
    println!(
        "a chain of {links} links carries most, T = {:.0}, at {:.1} times its rest",
        strongest.force, strongest.stretch
    );
    Ok(())
}
