//! Cards of laws in CalculiX 2.20, if `CALCULIX_SOURCE` names its source build: the forces of a block that it
//! computes from the written text are the derivatives of the law's energy.

use evidence::hosts;
use polycore::constitutive::hyperelastic::deck::{card, material_name};
use polycore::constitutive::hyperelastic::{MODELS, ModelDescriptor};

/// Lengths of a block of 1 × 1 × 1, J = 1.08.
const STRETCHES: [f64; 3] = [1.5, 0.9, 0.8];

/// Dᵢ: K = 40.
const COMPLIANCES: [f64; 3] = [5e-2, 2e-3, 1e-4];

/// Two elements; the plane between them is free along z.
const BLOCK: &str = "*NODE, NSET=ALL\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n\
                     8,0,1,1\n9,0,0,0.5\n10,1,0,0.5\n11,1,1,0.5\n12,0,1,0.5\n\
                     *ELEMENT, TYPE=C3D8, ELSET=BLOCK\n1,1,2,3,4,9,10,11,12\n2,9,10,11,12,5,6,7,8\n\
                     *NSET, NSET=X0\n1,4,5,8,9,12\n*NSET, NSET=Y0\n1,2,5,6,9,10\n*NSET, NSET=Z0\n1,2,3,4\n\
                     *NSET, NSET=X1\n2,3,6,7,10,11\n*NSET, NSET=Y1\n3,4,7,8,11,12\n*NSET, NSET=Z1\n5,6,7,8\n\
                     *BOUNDARY\nX0,1\nY0,2\nZ0,3\n";

/// Forces on the three faces in CalculiX, the nominal stresses.
fn forces(program: &std::path::Path, material: &str) -> [f64; 3] {
    let name = material.split("NAME=").nth(1).unwrap().lines().next().unwrap();
    let [x, y, z] = STRETCHES.map(|l| l - 1.0);
    let print = |face: &str| format!("*NODE PRINT, NSET={face}, TOTALS=ONLY\nRF\n");
    let deck = format!(
        "{BLOCK}{material}*SOLID SECTION, ELSET=BLOCK, MATERIAL={name}\n*STEP, NLGEOM, INC=1000\n\
         *STATIC\n0.05, 1.\n*CONTROLS, PARAMETERS=FIELD\n1e-9, 1e-9\n\
         *BOUNDARY\nX1,1,1,{x}\nY1,2,2,{y}\nZ1,3,3,{z}\n{}{}{}*END STEP\n",
        print("X1"),
        print("Y1"),
        print("Z1")
    );
    let folder = tempfile::tempdir().unwrap();
    let (told, results) = hosts::run_calculix(program, folder.path(), &deck);
    let row = |line: &str| -> Vec<f64> { line.split_whitespace().filter_map(|w| w.parse().ok()).collect() };
    let rows: Vec<Vec<f64>> = results.lines().map(row).filter(|row| row.len() == 3).collect();
    assert!(rows.len() >= 3 && results.contains("0.1000000E+01"), "{material}{told}{results}");
    let last = &rows[rows.len() - 3..];
    std::array::from_fn(|i| last[i][i])
}

/// Derivatives by the stretches of W(J^(−1/3) λ) + Σ (J − 1)²ⁱ/Dᵢ. `ARRUDA-BOYCE` has
/// (½(J² − 1) − ln J)/D₁, of the same K (Abaqus Theory Guide, 4.6.1).
fn derivatives(model: &ModelDescriptor, parameters: &[f64], compliances: &[f64]) -> [f64; 3] {
    let law = model.law(parameters).unwrap();
    let energy = |stretches: [f64; 3]| {
        let volume: f64 = stretches.iter().product();
        let terms = (1..).zip(compliances).map(|(i, d)| match model.key {
            "arruda-boyce" => (0.5 * (volume * volume - 1.0) - volume.ln()) / d,
            _ => (volume - 1.0).powi(2 * i) / d,
        });
        law.energy_at(stretches.map(|l| l / volume.cbrt())).unwrap() + terms.sum::<f64>()
    };
    let step = 1e-5;
    std::array::from_fn(|i| {
        let at = |change: f64| {
            let mut stretches = STRETCHES;
            stretches[i] += change;
            energy(stretches)
        };
        // fourth order
        (8.0 * (at(step) - at(-step)) - (at(2.0 * step) - at(-2.0 * step))) / (12.0 * step)
    })
}

/// Constants and forces have seven digits. Foams are left out: CalculiX ends in their first factorisation.
#[test]
fn cards_give_the_forces_of_their_laws() {
    let Some(source) = hosts::calculix() else { return };
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("ccx");
    hosts::link_calculix(&source, &[], &[], &program);
    let (mut worst, mut count): (f64, usize) = (0.0, 0);
    for model in MODELS {
        // in MPa
        let scale = |(value, unit): (&f64, &str)| if unit == "Pa" { 1e-6 * value } else { *value };
        let units = model.parameters.iter().map(|parameter| parameter.unit);
        let parameters: Vec<f64> = model.example.iter().zip(units).map(scale).collect();
        let text = card(&material_name(model.key, ""), model.key, &parameters, &COMPLIANCES);
        // CalculiX has neither this kind nor more than three terms; the card of eight chains is another law
        let lacks = ["VAN DER WAALS", "N=4", "N=5", "N=6", "USER MATERIAL"];
        if model.key == "eight-chain" || lacks.iter().any(|kind| text.contains(kind)) {
            continue;
        }
        let held = [("has D1 alone", 1), ("has D1 to D2 alone", 2)];
        let held = held.iter().find(|(note, _)| text.contains(note)).map_or(3, |(_, held)| *held);
        let found = forces(&program, &text);
        let expected = derivatives(model, &parameters, &COMPLIANCES[..held]);
        let largest = expected.iter().fold(0.0, |most: f64, force| most.max(force.abs()));
        let miss = found.iter().zip(expected).map(|(found, expected)| (found - expected).abs());
        let miss = miss.fold(0.0, f64::max) / largest;
        eprintln!("{}: {found:?}, {miss:.1e} from {expected:?}", model.key);
        worst = worst.max(miss);
        count += 1;
    }
    assert_eq!(count, 11);
    evidence::at_most("forces in CalculiX from cards against their laws, relative", worst, 1e-6);
}
