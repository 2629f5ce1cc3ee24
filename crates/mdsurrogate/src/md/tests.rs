use super::*;
use harness::case::Fault;

/// Table 3.2 and formulation.md, chapter 3: 720 runs; [3.3, 50], [4, 60], [1, 15]e-6 per step of 0.5 fs.
#[test]
fn the_thesis_grid() {
    let (protocol, grid) = (Protocol::default(), RateGrid::default());
    let runs = grid.runs(&protocol).unwrap();
    assert_eq!(runs.len(), 720);
    for (rates, [least, greatest]) in
        grid.rates(&protocol).iter().zip([[3.33, 50.0], [4.0, 60.0], [1.0, 15.0]])
    {
        assert_eq!(rates.len(), 15);
        let per_step = |rate: f64| rate * protocol.time_step * 1e6;
        // the table has two digits
        assert!((per_step(rates[0]) - least).abs() < 0.005 && (per_step(rates[14]) - greatest).abs() < 1e-9);
        let gap = rates[1] - rates[0];
        assert!(rates.windows(2).all(|pair| ((pair[1] - pair[0]) / gap - 1.0).abs() < 1e-9));
    }
    // 10,000 steps at the largest rate give the ultimate strain
    assert!((grid.rates(&protocol)[1][14] * 5000.0 - 0.6).abs() < 1e-12);
    let count = |kind: &str| runs.iter().filter(|run| run.kind == kind).count();
    assert_eq!(["ux", "uy", "uz", "bxy", "bxz", "byz"].map(count), [15, 15, 15, 225, 225, 225]);
    assert!(runs.iter().all(|run| run.snapshot < 6));
    // samples: (10,000/100 + 1) · 720
    assert_eq!((protocol.steps / protocol.every + 1) * 720, 72_720);
}

/// config.json of the project's data: five levels of 4 times the nominal rates in half the time.
#[test]
fn the_grid_of_the_shipped_data() {
    let protocol = Protocol { steps: 5000, every: 50, ..Protocol::default() };
    let rates = RateGrid { levels: 5, ..RateGrid::default() }.rates(&protocol);
    for (found, expected) in rates[0].iter().zip([1.333333333e-5, 6e-5, 1.066666667e-4, 1.533333333e-4, 2e-4])
    {
        assert!((found / expected - 1.0).abs() < 1e-8);
    }
    assert!((rates[2][0] / 4e-6 - 1.0).abs() < 1e-12);
}

#[test]
fn general_paths() {
    let run = MdRun::parse("x=1e-5, xy=-2e-5", "p0".into(), 0).unwrap();
    assert_eq!(run.rates, [Some(1e-5), None, None, Some(-2e-5), None, None]);
    assert_eq!(run.kind, "mxxy");
    assert_eq!(MdRun::parse("yz=1e-5", "p".into(), 0).unwrap().kind, "gyz");
    for bad in ["", "x", "w=1", "x=fast", "x=inf", "x=1,x=2"] {
        assert!(MdRun::parse(bad, "p".into(), 0).is_err(), "{bad}");
    }
    let text = input::deform(&Protocol::default(), &run, "d", "o");
    assert!(text.contains("change_box      all triclinic\n"));
    assert!(text.contains("deform 1 x erate 1e-5 xy erate -2e-5 remap x units box flip no\n"));
    assert!(text.contains("npt temp 300 300 50 y 1 1 500 z 1 1 500 scalexy no"));
    let all = MdRun::parse("x=1e-5,y=1e-5,z=1e-5", "p".into(), 0).unwrap();
    assert!(input::deform(&Protocol::default(), &all, "d", "o").contains("all nvt temp"));
}

/// Loading and unloading at the same rate of the initial lengths restore the box; replicas have other
/// velocities.
#[test]
fn unloading_and_replicas() {
    let protocol = Protocol { steps: 5000, every: 50, ..Protocol::default() };
    let run = MdRun::parse("z=1e-5,xz=2e-5,unload=0.6", "p0".into(), 5).unwrap();
    assert_eq!((run.unload, run.kind.as_str()), (Some(0.6), "mzxz"));
    let text = input::deform(&protocol, &run, "d", "o");
    for line in [
        "variable        vz equal $(lz)*-1e-5\nvariable        vxz equal $(lz)*-2e-5\n\
                     fix             pull all deform 1 z erate 1e-5 xz erate 2e-5 remap x units box flip \
                     no\n",
        "run             3000\nunfix           pull\n\
                     fix             pull all deform 1 z vel ${vz} xz vel ${vxz} remap x units box flip no\n\
                     run             2000\n",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    assert!(!text.contains("velocity"));
    let all = run.replicas(3, &protocol);
    assert_eq!(all.iter().map(|run| run.id.as_str()).collect::<Vec<_>>(), ["p0", "p0_r1", "p0_r2"]);
    assert_eq!(all.iter().map(|run| run.snapshot).collect::<Vec<_>>(), [5, 0, 1]);
    let text = input::deform(&protocol, &all[2], "d", "o");
    assert!(
        text.contains("velocity        all create 300 1203 dist gaussian\n")
            && text.contains("run             400\nunfix           bath\n")
    );
    let plan = serde_json::to_string(&all[0]).unwrap();
    assert!(!plan.contains("seed") && serde_json::from_str::<MdRun>(&plan).unwrap() == all[0]);
    for bad in ["unload=0.5", "x=1e-5,unload=1", "x=1e-5,unload=0", "x=1e-5,unload=0.5,unload=0.5"] {
        assert!(MdRun::parse(bad, "p".into(), 0).is_err(), "{bad}");
    }
}

/// §3.2: a hundred strain increments, each relaxed, then 5 ps of averages; at the end of each interval the
/// lengths are those at a constant rate.
#[test]
fn pulling_in_steps() {
    let stepwise = Some(Stepwise { pull: 100, relax: 2000 });
    let protocol = Protocol { steps: 1_210_000, every: 12_100, stepwise, ..Protocol::default() };
    protocol.check().unwrap();
    let run = MdRun::parse("z=2.5e-7,yz=1e-7", "p".into(), 0).unwrap();
    let text = input::deform(&protocol, &run, "d", "o");
    for line in [
        "variable        k loop 100\n",
        "variable        fz equal (1+1.5125e-3*v_k)/(1+1.5125e-3*(v_k-1))\n",
        "variable        dyz equal $(lz)*6.05e-4\n",
        "fix             pull all deform 1 z scale ${fz} yz delta ${dyz} remap x units box flip no\n",
        "fix             bath all npt temp 300 300 50 x 1 1 500 y 1 1 500 scalexy no scalexz no scaleyz no\n\
                     run             100\n",
        "fix             bath all nvt temp 300 300 50\nrun             12000\n",
        "fix             mean all ave/time 1 10000 12100 ",
        "fix             now all ave/time 1 1 12100 ",
    ] {
        assert!(text.contains(line), "{line}\n{text}");
    }
    // old plans lack this key, and new plans with constant rates omit it
    let plain = serde_json::to_string(&Protocol::default()).unwrap();
    assert!(!plain.contains("stepwise"));
    assert_eq!(serde_json::from_str::<Protocol>(&plain).unwrap(), Protocol::default());
    for (pull, relax) in [(0, 5), (100, 12_000), (u64::MAX, 5)] {
        let bad = Protocol { stepwise: Some(Stepwise { pull, relax }), ..protocol.clone() };
        assert!(bad.check().is_err(), "{pull} {relax}");
    }
}

/// LAMMPS runs in the folder of the set: a relative path to an engine must still be found.
#[test]
fn an_engine_is_named_from_anywhere() {
    let directory = tempfile::tempdir_in(".").unwrap();
    let path = directory.path().join("lmp");
    std::fs::write(&path, "").unwrap();
    let relative = std::path::Path::new(directory.path().file_name().unwrap()).join("lmp");
    let Ok(Engine::Executable(found)) = Engine::find(Some(&relative)) else { panic!("no engine") };
    assert!(found.is_absolute() && found.is_file(), "{}", found.display());
}

#[test]
fn invalid_plans_are_refused() {
    let good = Protocol::default();
    for bad in [
        Protocol { every: 0, ..good.clone() },
        Protocol { every: 3, ..good.clone() },
        Protocol { steps: 0, ..good.clone() },
        Protocol { time_step: f64::NAN, ..good.clone() },
        Protocol { snapshots: 0, ..good.clone() },
        Protocol { cells: [0, 1, 1], ..good.clone() },
        Protocol { equilibration: 2, ..good.clone() },
    ] {
        assert!(bad.check().is_err(), "{bad:?}");
    }
    assert!(RateGrid { levels: 201, ..RateGrid::default() }.runs(&good).is_err());
    assert!(RateGrid { rate_scale: 0.0, ..RateGrid::default() }.runs(&good).is_err());
    let directory = tempfile::tempdir().unwrap();
    let plan = |runs| MdPlan { protocol: Protocol::default(), runs };
    assert!(Folder::create(directory.path(), plan(vec![])).is_err());
    let run = MdRun::parse("x=1e-5", "p".into(), 0).unwrap();
    let twice = Folder::create(directory.path(), plan(vec![run.clone(), run.clone()])).unwrap_err();
    assert!(twice.to_string().contains("`p` twice"), "{twice}");
    Folder::create(directory.path(), plan(vec![run.clone()])).unwrap();
    Folder::create(directory.path(), plan(vec![run])).unwrap();
    let other = MdRun::parse("x=2e-5", "p".into(), 0).unwrap();
    assert!(
        Folder::create(directory.path(), plan(vec![other])).unwrap_err().to_string().contains("another plan")
    );
}

#[test]
fn no_engine_is_a_clear_error() {
    let error = Engine::find(Some(std::path::Path::new("/no/such/lmp"))).unwrap_err();
    assert!(error.to_string().contains("/no/such/lmp") && error.exit_code() == 2, "{error}");
}
