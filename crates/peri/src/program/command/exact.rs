//! `peri exact`: prints closed forms and constants of laws.

use crate::critical::Interpretation;
use crate::potential::{Chain, KernelFit, Law};
use crate::program::run::PeriFailure;
use crate::{calibrate, exact};
use clap::Subcommand;

/// Closed form to print.
#[derive(Subcommand)]
pub enum ExactCommand {
    /// Kirsch's stresses along x = 0 above a hole of radius 1 under unit tension, and the finite-width peak.
    Kirsch {
        /// Hole diameter over plate width.
        #[arg(long, default_value_t = 0.12)]
        width_ratio: f64,
    },
    /// Tension, tangent and energy of a bond law, its force maximum, critical stretches and kernel fit.
    Law {
        /// Bond law.
        #[arg(long, value_enum, default_value_t = Law::ChainOffset)]
        law: Law,
        /// Links per bond n̄.
        #[arg(long, default_value_t = 720.0)]
        links: f64,
        /// Dissociation energy D̂ = D/kθ.
        #[arg(long, default_value_t = 1200.0)]
        dissociation: f64,
        /// Largest stretch of the table and of the fit.
        #[arg(long, default_value_t = 3.0)]
        to: f64,
    },
    /// Small-strain moduli of a regular lattice.
    Lattice {
        /// Horizon over spacing.
        #[arg(long, default_value_t = 3.015)]
        horizon_ratio: f64,
    },
}

/// Largest stretch of tables.
const LARGEST_STRETCH: f64 = 1000.0;

impl ExactCommand {
    /// Prints the values.
    pub fn print(self) -> Result<bool, PeriFailure> {
        match self {
            Self::Kirsch { width_ratio } => {
                if !(0.0..1.0).contains(&width_ratio) {
                    let allowed = "0 to 1, less than 1".into();
                    return Err(crate::Error::Parameter {
                        name: "--width-ratio",
                        found: width_ratio,
                        allowed,
                    }
                    .into());
                }
                harness::say!("{:>8} {:>12} {:>12}", "y/a", "σxx/σ∞", "σyy/σ∞");
                for k in 0..=16 {
                    let y = 1.0 + f64::from(k) * 0.25;
                    let [xx, yy, _] = exact::kirsch(0.0, y, 1.0, 1.0);
                    harness::say!("{y:>8.2} {xx:>12.6} {yy:>12.6}");
                }
                harness::say!(
                    "finite width d/W = {width_ratio}: peak {:.6} (Heywood)",
                    exact::heywood_gross(width_ratio)
                );
            }
            Self::Law { law, links, dissociation, to } => print_law(law, links, dissociation, to)?,
            Self::Lattice { horizon_ratio } => {
                if !(1.0..=20.0).contains(&horizon_ratio) {
                    return Err(crate::Error::Parameter {
                        name: "--horizon-ratio",
                        found: horizon_ratio,
                        allowed: "1 to 20".into(),
                    }
                    .into());
                }
                harness::say!(
                    "{:<18} {:>8} {:>8} {:>8} {:>8} {:>8} {:>8}",
                    "lattice",
                    "C1111",
                    "C1122",
                    "E100",
                    "E110",
                    "ν",
                    "Zener"
                );
                for correction in
                    [crate::bonds::VolumeCorrection::None, crate::bonds::VolumeCorrection::Linear]
                {
                    for (name, m) in [
                        ("2D", calibrate::LatticeModuli::new::<2>(horizon_ratio, correction)),
                        ("3D", calibrate::LatticeModuli::new::<3>(horizon_ratio, correction)),
                    ] {
                        let name = format!("{name} volume {correction:?}");
                        harness::say!(
                            "{name:<18} {:>8.4} {:>8.4} {:>8.4} {:>8.4} {:>8.4} {:>8.4}",
                            m.c1111,
                            m.c1122,
                            m.e100,
                            m.e110,
                            m.nu,
                            m.zener
                        );
                    }
                }
            }
        }
        Ok(true)
    }
}

fn print_law(law: Law, links: f64, dissociation: f64, to: f64) -> Result<(), PeriFailure> {
    if !(1.0 < to && to <= LARGEST_STRETCH) {
        let allowed = format!("above 1, at most {LARGEST_STRETCH}");
        return Err(crate::Error::Parameter { name: "--to", found: to, allowed }.into());
    }
    let built = law.build(links, dissociation, false)?;
    harness::say!(
        "law {} with n̄ = {links}, D̂ = {dissociation}; tangent at rest {:.8}",
        law.name(),
        built.tangent()
    );
    harness::say!("{:>8} {:>14} {:>14} {:>14}", "l", "t/kθ", "t′/kθ", "φ/kθ");
    let from = (0.5 / to).clamp(0.05, 0.5);
    for k in 0..=12 {
        let l = from + (to - from) * f64::from(k) / 12.0;
        harness::say!(
            "{l:>8.4} {:>14.6} {:>14.6} {:>14.6}",
            built.tension(l),
            built.tension_derivative(l),
            built.energy(l)
        );
    }
    if law.is_chain() {
        let top = Chain::new(links, dissociation)?.strongest();
        harness::say!(
            "force maximum: λ_b {:.6}, λ̄ {:.4}, T/kθ {:.4}",
            top.link_stretch,
            top.stretch,
            top.force
        );
        for interpretation in Interpretation::ALL {
            harness::say!(
                "critical stretch of 1.2 √n̄ by {}: {:.4}",
                interpretation.name(),
                interpretation.stretch(1.2, links)
            );
        }
    }
    let fit = KernelFit::new(&*built, [from, to], 1e-9)?;
    harness::say!(
        "kernel fit over l = {from}..{to}: {}, largest relative error {:.1e}",
        fit.kind(),
        fit.max_error
    );
    Ok(())
}
