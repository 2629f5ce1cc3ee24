use super::*;
use crate::output::vtkhdf::{Cells, MeshSeries, ParticleSeries};
use polycore::random::SplitMix64;

const MOST: usize = 5_000_000;

/// Returns the data of a page.
fn page_data(page: &str) -> Json {
    let (_, rest) = page.split_once("<script type=\"application/json\" id=\"run\">").unwrap();
    serde_json::from_str(rest.split_once("</script>").unwrap().0).unwrap()
}

/// Noise does not deflate: steps and cells are left out, and the page says so.
#[test]
#[ignore = "takes 6 to 35 s; .ci/run runs it"]
fn large_runs_fit() {
    let folder = tempfile::tempdir().unwrap();
    let mut random = SplitMix64::new(7);
    let mut noise = |count: usize| -> Vec<f64> { (0..count).map(|_| random.uniform()).collect() };
    let particles: Vec<[f64; 3]> =
        (0..50_000).map(|k| [f64::from(k % 100), f64::from(k / 100 % 50), f64::from(k / 5000)]).collect();
    let mut series = ParticleSeries::create(folder.path().join("cloud.vtkhdf")).unwrap();
    for step in 0..25 {
        let stress = noise(9 * particles.len());
        series.step(f64::from(step), &particles, &[("cauchy_hardy", 9, &stress)]).unwrap();
    }
    series.finish().unwrap();
    let n = 36;
    let points: Vec<[f64; 3]> =
        (0..n * n * n).map(|k| [k % n, k / n % n, k / n / n].map(|x| 1e-3 * x as f64)).collect();
    let mut cells = Cells::default();
    for k in 0..(n - 1) * (n - 1) * (n - 1) {
        let first = k % (n - 1) + n * (k / (n - 1) % (n - 1)) + n * n * (k / (n - 1) / (n - 1));
        let corners = [0, 1, n + 1, n, n * n, n * n + 1, n * n + n + 1, n * n + n];
        cells.push(12, &corners.map(|corner| (first + corner) as u32));
    }
    let count = cells.len();
    let mut series = MeshSeries::create(folder.path().join("mesh.vtkhdf"), points.clone(), cells).unwrap();
    for step in 0..40 {
        let exists: Vec<f64> =
            (0..count).map(|cell| f64::from(u8::from(cell < (step + 1) * count / 40))).collect();
        let mut heat = noise(points.len());
        heat[0] = f64::NAN;
        heat[1] = f64::INFINITY;
        series.step(step as f64, &[("temperature_degC", 1, &heat)], &[("exists", 1, &exists)]).unwrap();
    }
    series.finish().unwrap();
    let page = view(folder.path()).unwrap();
    assert!(page.len() < MOST && page.len() > MOST / 4, "{} characters", page.len());
    let told = page_data(&page);
    let [cloud, mesh] = [0, 1].map(|k| &told["bodies"][k]);
    let notes = |body: &Json| body["notes"].to_string();
    assert!(
        notes(cloud).contains("of 25 steps") && notes(cloud).contains("for 50000 particles"),
        "{}",
        notes(cloud)
    );
    assert!(notes(mesh).contains("of 46656 points of the mesh"), "{}", notes(mesh));
    assert_eq!(mesh["frames"].as_array().unwrap().last().unwrap()["time"], 39.0, "the last step stays");
    // what is not finite stretches no colour bar
    let heat = &mesh["fields"][0];
    assert_eq!((heat["name"].as_str(), heat["unit"].as_str()), (Some("temperature"), Some("°C")));
    assert!(heat["levels"]["step"].as_f64().unwrap() * 4095.0 <= 1.0);
}

#[test]
fn folders_without_results() {
    let folder = tempfile::tempdir().unwrap();
    let error = view(folder.path()).unwrap_err();
    assert!(error.to_string().contains("there are no results") && error.exit_code() == 2, "{error}");
    assert_eq!(view(folder.path().join("none")).unwrap_err().exit_code(), 2);
    std::fs::write(folder.path().join("report.json"), "{").unwrap();
    assert!(view(folder.path()).unwrap_err().to_string().contains("report.json is not a valid report"));
    // an array without a name of a field, all of it missing
    std::fs::remove_file(folder.path().join("report.json")).unwrap();
    let mut cells = Cells::default();
    cells.push(10, &[0, 1, 2, 3]);
    let points = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut series = MeshSeries::create(folder.path().join("one.vtkhdf"), points, cells).unwrap();
    series.step(0.0, &[("alpha", 1, &[f64::NAN; 4])], &[]).unwrap();
    series.finish().unwrap();
    let told = page_data(&view(folder.path()).unwrap());
    assert_eq!(told["bodies"][0]["fields"][0]["levels"], json!({ "low": 0.0, "step": 0.0 }));
    assert_eq!(told["report"], json!(null));
}

/// The critical stretch of its own variant bounds what is joined, as in the pictures.
#[test]
fn cracks_as_in_the_pictures() {
    let mut report = Report::new("peri", "0", "");
    for (name, value) in
        [("critical_stretch[a=1mm dx=2mm]", 2.0), ("critical_stretch[dx=2mm]", 3.0), ("largest_stretch", 1.2)]
    {
        report.value(report::Named { name: name.to_owned(), unit: String::new() }, value);
    }
    let found = Found { report: Some(report), ..Found::default() };
    assert_eq!(found.bridge("a-1mm_dx-2mm"), 1.02 * 2.0);
    assert_eq!(found.bridge("dx-2mm"), 1.02 * 3.0);
    assert_eq!(found.bridge("other"), 1.5, "at least half a spacing more");
    assert_eq!(Found::default().bridge("other"), 100.0);
}
