use super::*;

const POINTS: usize = 5;
const STEPS: usize = 4;

fn position(step: usize, index: usize) -> [f64; 3] {
    [index as f64 + 0.1 * step as f64, (step * index) as f64, -0.5]
}

fn write_step(series: &mut ParticleSeries, step: usize) {
    let points: Vec<[f64; 3]> = (0..POINTS).map(|index| position(step, index)).collect();
    let displacement: Vec<f64> = (0..3 * POINTS).map(|at| (at + 100 * step) as f64).collect();
    let damage: Vec<f64> = (0..POINTS).map(|index| (index * step) as f64 / 7.0).collect();
    series
        .step(step as f64 * 0.25, &points, &[("displacement", 3, &displacement), ("damage", 1, &damage)])
        .unwrap();
}

fn check(path: &Path, steps: usize) {
    let series = read(path).unwrap();
    assert_eq!(series.times(), (0..steps).map(|step| step as f64 * 0.25).collect::<Vec<_>>());
    assert_eq!((series.len(), series.number_of_points()), (steps, POINTS));
    // backwards too: no step may lean on the one before
    for step in (0..steps).chain((0..steps).rev()) {
        assert_eq!(series.points(step).unwrap(), (0..POINTS).map(|i| position(step, i)).collect::<Vec<_>>());
        assert_eq!(series.data(step, "displacement").unwrap()[4], (4 + 100 * step) as f64);
        assert_eq!(series.data(step, "damage").unwrap()[3], (3 * step) as f64 / 7.0);
    }
    assert!(series.points(steps).unwrap_err().to_string().contains("there is no step"));
    assert!(series.data(0, "stress").unwrap_err().to_string().contains("displacement"));
}

fn listing(directory: &Path) -> Vec<String> {
    let entries = fs::read_dir(directory).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

fn written(directory: &Path, steps: usize) -> (PathBuf, ParticleSeries) {
    let path = directory.join("body.vtkhdf");
    let mut series = ParticleSeries::create(&path).unwrap();
    for step in 0..steps {
        write_step(&mut series, step);
    }
    (path, series)
}

#[test]
fn all_steps_come_back() {
    let directory = tempfile::tempdir().unwrap();
    let (path, series) = written(directory.path(), STEPS);
    // every frame is a complete file already
    assert_eq!(read(series.frame(2)).unwrap().times(), [0.5]);
    assert_eq!(series.finish().unwrap(), path);
    check(&path, STEPS);
    assert_eq!(listing(directory.path()), ["body.vtkhdf"]);
}

/// A process killed at any point leaves frames, possibly a half-written temporary file, possibly later frames
/// than its checkpoint; the resumed run ends with the bytes of an undisturbed one.
#[test]
fn resumed_series_equal_undisturbed_ones() {
    let undisturbed = tempfile::tempdir().unwrap();
    let (whole, series) = written(undisturbed.path(), STEPS);
    series.finish().unwrap();
    for (killed_after, checkpoint) in [(3, 3), (3, 2), (3, 0), (4, 1)] {
        let directory = tempfile::tempdir().unwrap();
        let (path, series) = written(directory.path(), killed_after);
        fs::write(temporary_name(&series.frame(killed_after)), b"half a frame").unwrap();
        fs::write(temporary_name(&path), b"half a series").unwrap();
        drop(series);
        let mut series = ParticleSeries::resume(&path, checkpoint).unwrap();
        assert_eq!(series.steps(), checkpoint);
        for step in checkpoint..STEPS {
            write_step(&mut series, step);
        }
        series.finish().unwrap();
        assert_eq!(listing(directory.path()), ["body.vtkhdf"]);
        assert_eq!(fs::read(&path).unwrap(), fs::read(&whole).unwrap());
    }
}

#[test]
fn a_finished_series_can_be_resumed() {
    let directory = tempfile::tempdir().unwrap();
    let (path, series) = written(directory.path(), STEPS);
    series.finish().unwrap();
    let before = fs::read(&path).unwrap();
    let mut series = ParticleSeries::resume(&path, 2).unwrap();
    assert_eq!(listing(directory.path()), ["body.frames"]);
    (2..STEPS).for_each(|step| write_step(&mut series, step));
    series.finish().unwrap();
    assert_eq!(fs::read(&path).unwrap(), before);
    let error = ParticleSeries::resume(&path, 9).unwrap_err();
    assert!(error.to_string().contains("cannot resume after 9 steps, only 4 were written"), "{error}");
    let error = ParticleSeries::resume(directory.path().join("new.vtkhdf"), 1).unwrap_err();
    assert!(error.to_string().contains("only 0 were written"), "{error}");
    check(&path, STEPS);
}

#[test]
fn a_new_run_removes_the_old_one() {
    let directory = tempfile::tempdir().unwrap();
    let (path, series) = written(directory.path(), STEPS);
    series.finish().unwrap();
    let (_, series) = written(directory.path(), 1);
    assert!(!path.exists());
    series.finish().unwrap();
    check(&path, 1);
}

#[test]
fn arrays_that_do_not_fit_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("body.vtkhdf");
    let points = [[0.0; 3], [1.0; 3]];
    let fail = |time: f64, points: &[[f64; 3]], data: &[Data<'_>]| {
        let mut series = ParticleSeries::create(&path).unwrap();
        series.step(0.0, &[[0.0; 3], [1.0; 3]], &[("a", 1, &[1.0, 2.0])]).unwrap();
        let error = series.step(time, points, data).unwrap_err().to_string();
        assert_eq!(series.steps(), 1);
        error
    };
    let a: Data<'_> = ("a", 1, &[1.0, 2.0]);
    assert!(fail(1.0, &[], &[a]).contains("no points"));
    assert!(fail(1.0, &[[0.0; 3], [f64::NAN; 3]], &[a]).contains("point 1 is"));
    assert!(fail(0.0, &points, &[a]).contains("greater than the last"));
    assert!(fail(f64::NAN, &points, &[a]).contains("finite"));
    assert!(fail(1.0, &points, &[("a", 2, &[1.0, 2.0])]).contains("2 values for 2 points of 2 components"));
    assert!(fail(1.0, &points, &[("a", 0, &[])]).contains("0 components"));
    assert!(fail(1.0, &points, &[a, a]).contains("given twice"));
    let broken = fail(1.0, &points, &[("a", 1, &[1.0, f64::NAN])]);
    assert!(broken.contains("`a` is not finite: NaN at point 1, [1.0, 1.0, 1.0] m, time 1"), "{broken}");
    assert!(fail(1.0, &points, &[("x/y", 1, &[1.0, 2.0])]).contains("not a valid name"));
    assert!(fail(1.0, &points, &[]).contains("the steps before have 2 points with a[1]"));
    assert!(fail(1.0, &[[0.0; 3]], &[("a", 1, &[1.0])]).contains("has 1 points"));
    assert!(ParticleSeries::create(&path).unwrap().finish().unwrap_err().to_string().contains("no step"));
    assert!(ParticleSeries::create(directory.path().join("body.h5")).is_err());
}

/// Tensors have seven digits; what does not fit into them is an error, not infinity in a file.
#[test]
fn large_steps_and_tensors() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("large.vtkhdf");
    let count = 100_003;
    let mut series = ParticleSeries::create(&path).unwrap();
    for step in 0..3 {
        let points: Vec<[f64; 3]> = (0..count).map(|index| position(step, index)).collect();
        let stress: Vec<f64> = (0..9 * count).map(|k| (step + k) as f64 / 3.0).collect();
        series.step(step as f64, &points, &[("stress", 9, &stress)]).unwrap();
        let large = vec![1e39; 9 * count];
        let error = series.step(step as f64 + 0.5, &points, &[("stress", 9, &large)]).unwrap_err();
        assert!(error.to_string().contains("`stress` is not finite: 1000000"), "{error}");
    }
    let read = read(series.finish().unwrap()).unwrap();
    for step in [2, 0, 1] {
        let points = read.points(step).unwrap();
        assert!((0..count).all(|index| points[index] == position(step, index)));
        let stress = read.data(step, "stress").unwrap();
        assert!((0..9 * count).all(|k| stress[k] == f64::from(((step + k) as f64 / 3.0) as f32)));
    }
}

#[test]
fn damaged_files_are_errors() {
    let directory = tempfile::tempdir().unwrap();
    let (path, series) = written(directory.path(), 2);
    series.finish().unwrap();
    let bytes = fs::read(&path).unwrap();
    assert!(matches!(read(directory.path().join("none.vtkhdf")), Err(Error::Io { .. })));
    for length in (0..bytes.len()).step_by(bytes.len() / 97) {
        fs::write(&path, &bytes[..length]).unwrap();
        let result = read(&path).and_then(|series| series.points(1).and(series.data(1, "damage")));
        assert!(matches!(result, Err(Error::Format { .. })), "{length} of {} bytes: {result:?}", bytes.len());
    }
}

fn grid(directory: &Path, steps: usize) -> (PathBuf, MeshSeries) {
    let path = directory.join("part.vtkhdf");
    let points: Vec<[f64; 3]> =
        (0..12).map(|k| [f64::from(k % 2), f64::from(k / 2 % 2), f64::from(k / 4)]).collect();
    let mut cells = Cells::default();
    cells.push(12, &[0, 1, 3, 2, 4, 5, 7, 6]);
    cells.push(10, &[4, 5, 6, 8]);
    let mut series = MeshSeries::create(&path, points, cells).unwrap();
    for step in 0..steps {
        grid_step(&mut series, step);
    }
    (path, series)
}

fn grid_step(series: &mut MeshSeries, step: usize) {
    let temperature: Vec<f64> = (0..12).map(|k| (100 * step + k) as f64).collect();
    let exists = [1.0, (step > 1) as u8 as f64];
    series.step(step as f64, &[("temperature", 1, &temperature)], &[("exists", 1, &exists)]).unwrap();
}

#[test]
fn fields_on_a_mesh_come_back() {
    let directory = tempfile::tempdir().unwrap();
    let (path, series) = grid(directory.path(), STEPS);
    series.finish().unwrap();
    let read = super::read(&path).unwrap();
    assert_eq!((read.len(), read.number_of_points()), (STEPS, 12));
    assert_eq!(read.cell_arrays(), [("exists".to_owned(), 1)]);
    for step in [3, 0, 2, 1] {
        assert_eq!(read.points(step).unwrap()[11], [1.0, 1.0, 2.0]);
        assert_eq!(read.data(step, "temperature").unwrap()[7], (100 * step + 7) as f64);
        assert_eq!(read.cell_data(step, "exists").unwrap(), [1.0, if step > 1 { 1.0 } else { 0.0 }]);
    }
    assert!(read.cell_data(4, "exists").unwrap_err().to_string().contains("no step 4"));
    assert!(read.cell_data(0, "temperature").unwrap_err().to_string().contains("there are exists"));
    let whole = fs::read(&path).unwrap();
    let written = read.cells().unwrap();
    let (points, cells) = (read.points(0).unwrap(), {
        let mut cells = Cells::default();
        cells.push(12, &[0, 1, 3, 2, 4, 5, 7, 6]);
        cells.push(10, &[4, 5, 6, 8]);
        cells
    });
    assert_eq!(written, cells);
    drop(read);
    let mut series = MeshSeries::resume(&path, points, cells, 2).unwrap();
    (2..STEPS).for_each(|step| grid_step(&mut series, step));
    series.finish().unwrap();
    assert_eq!(fs::read(&path).unwrap(), whole);
}

#[test]
fn meshes_that_do_not_fit_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("part.vtkhdf");
    let refused = |points: &[[f64; 3]], cells: Cells, told: &str| {
        let error = MeshSeries::create(&path, points.to_vec(), cells).unwrap_err().to_string();
        assert!(error.contains(told), "{error}");
    };
    let points = [[0.0; 3], [1.0; 3]];
    refused(&[], Cells::default(), "no points");
    refused(&points, Cells::default(), "no cells");
    let mut far = Cells::default();
    far.push(10, &[0, 1, 1, 2]);
    refused(&points, far.clone(), "point 2 of a mesh of 2 points");
    far.ends[0] = 3;
    refused(&points, far, "do not fit together");
    let (_, mut series) = grid(directory.path(), 1);
    let error = series.step(1.0, &[("temperature", 1, &[0.0; 12])], &[("exists", 1, &[0.0; 3])]);
    assert!(error.unwrap_err().to_string().contains("3 values for 2 cells of 1 components"));
}

/// Numbers of the steps survive the merging, and a resumed run; NaN stands for none.
#[test]
fn numbers_of_steps() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("a.vtkhdf");
    let (points, values) = ([[0.0; 3], [1.0, 2.0, 3.0]], [4.0, 5.0]);
    let write = |series: &mut ParticleSeries, step: usize| {
        let moments =
            [("load", 10.0 * step as f64), ("displacement", if step == 1 { f64::NAN } else { 0.5 })];
        series.moment(step as f64, &points, &[("damage", 1, &values)], &moments).unwrap();
    };
    let mut series = ParticleSeries::create(&path).unwrap();
    (0..2).for_each(|step| write(&mut series, step));
    drop(series);
    let mut series = ParticleSeries::resume(&path, 2).unwrap();
    write(&mut series, 2);
    series.finish().unwrap();
    let read = read(&path).unwrap();
    assert_eq!([0, 1, 2].map(|step| read.moment(step, "load")), [Some(0.0), Some(10.0), Some(20.0)]);
    assert_eq!(read.moment(2, "displacement"), Some(0.5));
    assert!(read.moment(1, "displacement").unwrap().is_nan());
    assert_eq!((read.moment(0, "Values"), read.moment(3, "load")), (None, None));
    let mut series = ParticleSeries::create(&path).unwrap();
    assert!(series.moment(0.0, &points, &[], &[("Values", 1.0)]).is_err());
}
