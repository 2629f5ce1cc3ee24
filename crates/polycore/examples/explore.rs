use polycore::constitutive::hyperelastic::model;
use polycore::constitutive::viscoelastic::fit::*;
use polycore::constitutive::viscoelastic::{Pace, Scheme};
use std::time::Instant;

fn columns(path: &str) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .filter(|l| !l.starts_with('#'))
        .skip(1)
        .map(|l| l.split(',').map(str::to_owned).collect())
        .collect()
}
fn zhao(dir: &str) -> Vec<Run> {
    let rows = columns(&format!("{dir}/vhb4910_zhao2025.csv"));
    let mut runs: Vec<(String, f64, Vec<Measurement>)> = Vec::new();
    for r in rows {
        let name = format!("{}-{}", r[1], r[2]);
        let p: Vec<f64> = r[3..6].iter().map(|c| c.parse().unwrap()).collect();
        if runs.last().is_none_or(|l| l.0 != name) {
            runs.push((name, r[1].parse().unwrap(), vec![]));
        }
        runs.last_mut().unwrap().2.push(Measurement { time: p[0], strain: p[1], nominal: p[2] * 1e3 });
    }
    runs.into_iter().map(|(n, r, p)| Run::new(&n, r, Test::Uniaxial, p).unwrap()).collect()
}
fn hnbr(dir: &str) -> Vec<Run> {
    let rows = columns(&format!("{dir}/hnbr50_cycles_2003.csv"));
    let mut runs: Vec<(String, f64, Vec<Measurement>)> = Vec::new();
    for r in rows {
        let name = r[0].clone();
        let p: Vec<f64> = r[1..4].iter().map(|c| c.parse().unwrap()).collect();
        if runs.last().is_none_or(|l| l.0 != name) {
            runs.push((name, r[0].parse().unwrap(), vec![]));
        }
        runs.last_mut().unwrap().2.push(Measurement { time: p[0], strain: p[1], nominal: p[2] * 1e6 });
    }
    runs.into_iter().map(|(n, r, p)| Run::new(&n, r, Test::Uniaxial, p).unwrap()).collect()
}
fn cycles(path: &str, hossain: bool) -> Vec<Run> {
    let mut runs: Vec<(String, f64, Vec<[f64; 2]>)> = Vec::new();
    let mut rows = columns(path);
    if !hossain {
        rows.retain(|r| r[1] == "data");
        let order = |r: &Vec<String>| {
            let s: f64 = r[3].parse().unwrap();
            let b = match r[2].as_str() {
                "load" => 0.0,
                "peak" => 1.0,
                _ => 2.0,
            };
            (r[0].clone(), b, if b < 2.0 { -s } else { s })
        };
        rows.sort_by(|a, b| order(a).partial_cmp(&order(b)).unwrap());
    }
    for r in rows {
        let name = if hossain { format!("{}-{}", r[0], r[1]) } else { r[0].clone() };
        let p: Vec<f64> = r[3..5].iter().map(|c| c.parse().unwrap()).collect();
        if runs.last().is_none_or(|l| l.0 != name) {
            runs.push((name, r[0].parse().unwrap(), vec![]));
        }
        runs.last_mut().unwrap().2.push([p[0], p[1] * if hossain { 1e3 } else { 1e6 }]);
    }
    runs.into_iter().map(|(n, r, p)| Run::cycle(&n, r, Test::Uniaxial, &p).unwrap()).collect()
}
fn spring(s: &str) -> SpringForm {
    match s {
        "nh" => SpringForm::NeoHookean,
        "lp1" => SpringForm::LopezPamies(1),
        "lp2" => SpringForm::LopezPamies(2),
        "ec" => SpringForm::EightChain,
        "s" => SpringForm::Proportional,
        _ => panic!(),
    }
}
fn visc(s: &str) -> ViscosityForm {
    match s {
        "c" => ViscosityForm::Constant,
        "klp" => ViscosityForm::KumarLopezPamies,
        "bb" => ViscosityForm::BergstromBoyce,
        "e" => ViscosityForm::Eyring,
        _ => panic!(),
    }
}
/// eq:spring-visc,spring-visc[:fix=val;free]
fn form(text: &str) -> Form {
    let parts: Vec<&str> = text.split(':').collect();
    let branches = parts[1]
        .split(',')
        .map(|b| {
            let (s, v) = b.split_once('-').unwrap();
            BranchForm { spring: spring(s), viscosity: visc(v) }
        })
        .collect();
    let mut f = Form::new(model(parts[0]).unwrap(), branches);
    if let Some(o) = parts.get(2) {
        for x in o.split(';') {
            match x.split_once('=') {
                Some((n, v)) => f.fixed.push((n.into(), v.parse().unwrap())),
                None => f.free.push(x.into()),
            }
        }
    }
    f
}
fn main() {
    let args: Vec<String> = std::env::args().collect();
    let dir = "/work/shared/anchors/time";
    let runs = match args[1].as_str() {
        "zhao" => zhao(dir),
        "hnbr" => hnbr(dir),
        "vhb" => cycles(&format!("{dir}/vhb4910_uniaxial_hossain2012.csv"), true),
        "bb" => cycles(&format!("{dir}/hnbr_compression_bergstrom_boyce1998.csv"), false),
        _ => panic!(),
    };
    let starts: usize = args[2].parse().unwrap();
    for text in &args[3..] {
        let f = form(text);
        let settings = FitSettings { starts, reach: 1.2, ..Default::default() };
        let t = Instant::now();
        match fit(&f, &runs, &settings) {
            Err(e) => println!("{text}: {e}"),
            Ok(found) => {
                println!(
                    "{text}: rms {:.4} kPa  starts {:?} evals {} time {:.1?} slopes {:?}",
                    found.pooled.rms / 1e3,
                    found.starts,
                    found.evaluations,
                    t.elapsed(),
                    found.least_slopes
                );
                for c in &found.constants {
                    println!(
                        "   {} = {:.5e} {:?} {:?}",
                        c.constant.name, c.value, c.interval, c.constant.fixed
                    );
                }
                println!("   sv {:.3?}", found.singular_values);
                println!(
                    "   r2 {:?}",
                    found
                        .runs
                        .iter()
                        .map(|r| format!("{:.2}/{:.3}", r.rms / 1e3, r.r2.unwrap()))
                        .collect::<Vec<_>>()
                );
                let law = found.law().unwrap();
                let mut worst: f64 = 0.0;
                for run in &runs {
                    let a = run.stresses(&law, settings.pace).unwrap();
                    let b = run.stresses(&law, Pace::Equal(20, Scheme::Sdirk2)).unwrap();
                    let d =
                        (a.iter().zip(&b).map(|(x, y)| (x - y).powi(2)).sum::<f64>() / a.len() as f64).sqrt();
                    worst = worst.max(d);
                }
                println!("   integration error rms, worst run: {:.4} kPa", worst / 1e3);
                if args[1] == "vhb" {
                    let base = FitSettings { starts: 0, first: Some(found.values()), ..settings.clone() };
                    match leave_out(&f, &runs, |r| r.rate == 0.03, &base, &|| false) {
                        Ok(l) => println!(
                            "   leave 0.03: fit {:.3} out {:.3}",
                            l.fit.pooled.rms / 1e3,
                            l.pooled.rms / 1e3
                        ),
                        Err(e) => println!("   leave: {e}"),
                    }
                }
                if args[1] == "zhao" {
                    let base = FitSettings { starts: 1, first: Some(found.values()), ..settings.clone() };
                    for rate in rates(&runs) {
                        match leave_out(&f, &runs, |r| r.rate == rate, &base, &|| false) {
                            Ok(l) => println!(
                                "   leave rate {rate}: fit {:.3} out {:.3}",
                                l.fit.pooled.rms / 1e3,
                                l.pooled.rms / 1e3
                            ),
                            Err(e) => println!("   leave {rate}: {e}"),
                        }
                    }
                    for top in [1.6, 2.1, 2.6] {
                        match leave_out(
                            &f,
                            &runs,
                            |r| r.points().iter().any(|p| p.strain > top),
                            &base,
                            &|| false,
                        ) {
                            Ok(l) => println!(
                                "   leave above {top}: fit {:.3} out {:.3} r2 {:?}",
                                l.fit.pooled.rms / 1e3,
                                l.pooled.rms / 1e3,
                                l.pooled.r2
                            ),
                            Err(e) => println!("   leave {top}: {e}"),
                        }
                    }
                    for s in [1.5, 2.0, 3.0, 4.0, 5.0, 6.0] {
                        let ramp = (s - 1.0) / 0.25;
                        let mut path = vec![[0.0, 1.0]];
                        for k in 1..=40 {
                            path.push([ramp * k as f64 / 40.0, 1.0 + (s - 1.0) * k as f64 / 40.0]);
                        }
                        let hold = [0.5, 1.0, 3.0, 10.0, 30.0, 100.0, 400.0];
                        for h in hold {
                            path.push([ramp + h, s]);
                        }
                        match Test::Uniaxial.follow(&law, &path, Pace::Within(20.0)) {
                            Ok(p) => println!(
                                "   {s}: {:.1?}",
                                p[40..].iter().map(|x| x / 1e3).collect::<Vec<_>>()
                            ),
                            Err(e) => println!("   {s}: {e}"),
                        }
                    }
                    println!("   total {:.1?}", t.elapsed());
                }
            }
        }
    }
}
