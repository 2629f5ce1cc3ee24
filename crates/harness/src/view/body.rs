//! A body of a page: its shape, and its fields at some of the steps of a file.

use serde::Serialize;

use super::frames::FrameReader;
use super::pack::{LevelRange, NOTHING, PLACES, Slot, Store, VALUES};
use super::particles::ParticleChoice;
use super::scalars::{ArrayScalar, scalars};
use super::solid::{PageSolid, corners_of};
use polycore::Error;

/// Arrays of displacements, m: they move the points.
const DISPLACEMENT: [&str; 2] = ["displacement", "displacement_m"];
/// The cell array that tells which cells there are.
const EXISTS: &str = "exists";
/// Fields of a body at most.
const FIELDS: usize = 10;

/// Resolution of a body in steps and cells.
#[derive(Clone, Copy, Debug)]
pub struct Detail {
    /// Steps at most.
    pub steps: usize,
    /// 1, or more where cells are left out.
    pub coarser: usize,
}

/// A body as the page reads it; its numbers are in a [`Store`].
#[derive(Debug, Serialize)]
pub struct PageBody {
    name: String,
    /// Particles: times count load steps.
    particles: bool,
    /// Drawn as sheet.
    plane: bool,
    cells: Vec<Group>,
    /// x, y, z; the numbers are lengths in m.
    points: [Slot; 3],
    levels: [LevelRange; 3],
    moves: Option<PageMoves>,
    /// Step from which each cell exists.
    births: Option<Slot>,
    frames: Vec<PageFrame>,
    fields: Vec<PageField>,
    /// Notes on what is left out.
    notes: Vec<String>,
}

/// Cells of one type; corner k of all cells is row k, low and high halves of the numbers.
#[derive(Debug, Serialize)]
struct Group {
    kind: u8,
    low: Slot,
    high: Slot,
}

/// Displacements: a row for each step.
#[derive(Debug, Serialize)]
struct PageMoves {
    slots: [Slot; 3],
    levels: LevelRange,
}

#[derive(Debug, Serialize)]
struct PageFrame {
    time: f64,
    displacement: Option<f64>,
    load: Option<f64>,
}

#[derive(Debug, Serialize)]
struct PageField {
    name: String,
    unit: &'static str,
    /// True for a field of cells, false for one of points.
    cells: bool,
    levels: LevelRange,
    slot: Slot,
}

/// A field that is read: the array, of cells or of points, and what is made of it.
struct FieldSource<'a> {
    array: &'a str,
    of_cells: bool,
    scalar: ArrayScalar,
}

impl PageBody {
    /// Reads a file. Neighbours of a lattice up to `bridge` spacings apart have no crack between them.
    ///
    /// # Errors
    /// [`Error::Format`] for damaged data; [`Error::Data`] where nothing can be drawn.
    pub fn new(
        frames: &FrameReader,
        name: String,
        bridge: f64,
        detail: Detail,
    ) -> Result<(Self, Store), Error> {
        let steps = chosen(frames.len(), detail.steps);
        let mut notes = Vec::new();
        if steps.len() < frames.len() {
            notes.push(format!("{} of {} steps", steps.len(), frames.len()));
        }
        let (solid, plane) = match frames.moves {
            true => particles(frames, &steps, bridge, detail, &mut notes)?,
            false => mesh(frames, &steps, detail, &mut notes)?,
        };
        let nothing =
            || Error::Data { what: format!("fields `{name}`"), reason: "no cell can be drawn".into() };
        let mut store = Store::default();
        let axes = [0, 1, 2].map(|d| {
            let values: Vec<f64> = solid.points.iter().map(|x| x[d]).collect();
            let levels = LevelRange::over(values.iter().copied(), PLACES)?;
            Some((levels, store.push(&[values.iter().map(|&x| levels.level(x)).collect()])))
        });
        let [Some(x), Some(y), Some(z)] = axes else { return Err(nothing()) };
        let moves = moves(&solid, &mut store);
        let births = births(frames, &steps, &solid)?.map(|births| store.push(&[births]));
        let cells = groups(&solid, &mut store);
        let fields = fields(frames, &steps, &solid, plane, &mut store, &mut notes)?;
        let frame = |&step: &usize| {
            frames.read_step(step, |series, step| {
                let of = |name: &str| series.moment(step, name).filter(|x| x.is_finite());
                Ok(PageFrame {
                    time: series.times()[step],
                    displacement: of("displacement"),
                    load: of("load"),
                })
            })
        };
        let times = steps.iter().map(frame).collect::<Result<_, _>>()?;
        if frames.unfinished() {
            notes.push("the run has not ended".into());
        }
        let body = Self {
            name,
            particles: frames.moves,
            plane,
            cells,
            points: [x.1, y.1, z.1],
            levels: [x.0, y.0, z.0],
            moves,
            births,
            frames: times,
            fields,
            notes,
        };
        Ok((body, store))
    }
}

/// Steps at equal distances, the last one among them.
fn chosen(count: usize, most: usize) -> Vec<usize> {
    let most = most.clamp(1, count.max(1));
    match most {
        1 => vec![count.saturating_sub(1)],
        _ => (0..most).map(|k| (k * (count - 1) + (most - 1) / 2) / (most - 1)).collect(),
    }
}

/// Returns the particles of a file as cells.
fn particles(
    frames: &FrameReader,
    steps: &[usize],
    bridge: f64,
    detail: Detail,
    notes: &mut Vec<String>,
) -> Result<(PageSolid, bool), Error> {
    let displaced = frames.arrays()[0].iter().any(|(name, n)| name == DISPLACEMENT[0] && *n == 3);
    let reference = frames.read_step(0, |series, step| {
        let mut points = series.points(step)?;
        if displaced {
            let moved = series.data(step, DISPLACEMENT[0])?;
            points.iter_mut().zip(moved.chunks_exact(3)).for_each(|(x, u)| (0..3).for_each(|d| x[d] -= u[d]));
        }
        Ok(points)
    })?;
    let choice = ParticleChoice::from_positions(&reference, detail.coarser);
    if choice.kept.len() < reference.len() {
        notes.push(format!("{} cells for {} particles", choice.kept.len(), reference.len()));
    }
    let keep =
        |all: Vec<[f64; 3]>| -> Vec<[f64; 3]> { choice.kept.iter().map(|&k| all[k as usize]).collect() };
    let positions =
        steps.iter().map(|&step| frames.read_step(step, |series, step| Ok(keep(series.points(step)?))));
    let positions = positions.collect::<Result<Vec<_>, Error>>()?;
    Ok((choice.solid(&keep(reference), &positions, bridge).by_kind(), choice.plane))
}

/// Returns the mesh of a file.
fn mesh(
    frames: &FrameReader,
    steps: &[usize],
    detail: Detail,
    notes: &mut Vec<String>,
) -> Result<(PageSolid, bool), Error> {
    let (points, cells) = (frames.read_step(0, |series, _| series.points(0))?, frames.cells()?);
    let mut solid = PageSolid::mesh(&points, &cells, detail.coarser).by_kind();
    let drawn: std::collections::HashSet<u32> = solid.cell_of.iter().copied().collect();
    if solid.points.len() < points.len() && drawn.len() < cells.len() {
        notes.push(format!("{} of {} points of the mesh", solid.points.len(), points.len()));
    }
    let names = &frames.arrays()[0];
    if let Some((name, _)) = names.iter().find(|(name, n)| DISPLACEMENT.contains(&name.as_str()) && *n == 3) {
        for &step in steps {
            let all = frames.read_step(step, |series, step| series.data(step, name))?;
            // what does not exist yet has not moved
            let known = |x: f64| if x.is_finite() { x } else { 0.0 };
            let of = |&point: &u32| [0, 1, 2].map(|d| known(all[3 * point as usize + d]));
            solid.moved.push(solid.point_of.iter().map(of).collect());
        }
    }
    let plane = solid.kinds.iter().all(|&kind| kind <= 9);
    Ok((solid, plane))
}

fn moves(solid: &PageSolid, store: &mut Store) -> Option<PageMoves> {
    let levels = LevelRange::over(solid.moved.iter().flatten().flatten().copied(), PLACES)?;
    let slots = [0, 1, 2].map(|d| {
        let row = |step: &Vec<[f64; 3]>| step.iter().map(|u| levels.level(u[d])).collect();
        store.push(&solid.moved.iter().map(row).collect::<Vec<Vec<u16>>>())
    });
    Some(PageMoves { slots, levels })
}

/// Returns the first of the steps at which each cell exists.
fn births(frames: &FrameReader, steps: &[usize], solid: &PageSolid) -> Result<Option<Vec<u16>>, Error> {
    if !frames.arrays()[1].iter().any(|(name, n)| name == EXISTS && *n == 1) {
        return Ok(None);
    }
    let mut births = vec![NOTHING; solid.cell_of.len()];
    for (index, &step) in steps.iter().enumerate() {
        let exists = frames.read_step(step, |series, step| series.cell_data(step, EXISTS))?;
        for (birth, &cell) in births.iter_mut().zip(&solid.cell_of) {
            if *birth == NOTHING && exists[cell as usize] > 0.5 {
                *birth = index as u16;
            }
        }
    }
    Ok(Some(births))
}

/// Cells by type, as corners.
fn groups(solid: &PageSolid, store: &mut Store) -> Vec<Group> {
    let mut first = 0;
    let groups = solid.kinds.chunk_by(|a, b| a == b).map(|kinds| {
        let count = corners_of(kinds[0]);
        let corners = &solid.corners[first..first + count * kinds.len()];
        first += corners.len();
        let row = |corner: usize, half: u32| -> Vec<u16> {
            corners.iter().skip(corner).step_by(count).map(|point| (point >> half) as u16).collect()
        };
        let [low, high] =
            [0, 16].map(|half| store.push(&(0..count).map(|corner| row(corner, half)).collect::<Vec<_>>()));
        Group { kind: kinds[0], low, high }
    });
    groups.collect()
}

fn fields(
    frames: &FrameReader,
    steps: &[usize],
    solid: &PageSolid,
    plane: bool,
    store: &mut Store,
    notes: &mut Vec<String>,
) -> Result<Vec<PageField>, Error> {
    let [of_points, of_cells] = frames.arrays();
    let sources = |arrays: &'_ [(String, usize)], of_cells: bool| -> Vec<(String, usize, bool)> {
        let shown = |(name, _): &&(String, usize)| {
            !DISPLACEMENT.contains(&name.as_str()) && name != EXISTS && name != "input_index"
        };
        arrays.iter().filter(shown).map(|(name, n)| (name.clone(), *n, of_cells)).collect()
    };
    let mut arrays = sources(of_points, false);
    arrays.extend(sources(of_cells, true));
    let mut wanted: Vec<FieldSource> = Vec::new();
    for (array, components, of_cells) in &arrays {
        let scalars = scalars(array, *components, plane).into_iter();
        wanted.extend(scalars.map(|scalar| FieldSource { array, of_cells: *of_cells, scalar }));
    }
    wanted.sort_by_key(|source| source.scalar.rank);
    if wanted.len() > FIELDS {
        let names: Vec<&str> = wanted[FIELDS..].iter().map(|source| source.scalar.name.as_str()).collect();
        notes.push(format!("fields left out: {}", names.join(", ")));
        wanted.truncate(FIELDS);
    }
    let mut fields = Vec::new();
    for FieldSource { array, of_cells, scalar } in &wanted {
        // particles are cells here, and the arrays of their file are of points
        let cells = *of_cells || solid.point_of.is_empty();
        let places = if cells { &solid.cell_of } else { &solid.point_of };
        let mut rows: Vec<Vec<f64>> = Vec::new();
        for &step in steps {
            let all = frames.read_step(step, |series, step| match of_cells {
                true => series.cell_data(step, array),
                false => series.data(step, array),
            })?;
            let of = |&place: &u32| {
                let first = place as usize * scalar.components;
                all.get(first..first + scalar.components).map_or(f64::NAN, |values| (scalar.of)(values))
            };
            rows.push(places.iter().map(of).collect());
        }
        let largest = rows.iter().flatten().filter(|x| x.is_finite()).fold(0.0, |m: f64, x| m.max(x.abs()));
        let (unit, scale) = scalar.shown(largest);
        // a field without any value is there all the same, and grey
        let levels = LevelRange::over(rows.iter().flatten().map(|x| x * scale), VALUES)
            .unwrap_or(LevelRange { low: 0.0, step: 0.0 });
        let row = |row: &Vec<f64>| row.iter().map(|x| levels.level(x * scale)).collect();
        let slot = store.push(&rows.iter().map(row).collect::<Vec<_>>());
        fields.push(PageField { name: scalar.name.clone(), unit, cells, levels, slot });
    }
    Ok(fields)
}

#[cfg(test)]
mod tests {
    use super::chosen;

    #[test]
    fn steps_are_spread_to_the_last() {
        assert_eq!(chosen(5, 60), [0, 1, 2, 3, 4]);
        assert_eq!(chosen(9, 3), [0, 4, 8]);
        assert_eq!((chosen(7, 1), chosen(1, 9)), (vec![6], vec![0]));
        for (count, most) in [(151, 60), (51, 26), (100, 99)] {
            let steps = chosen(count, most);
            assert_eq!((steps.len(), steps[0], steps.last()), (most, 0, Some(&(count - 1))));
            assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");
        }
    }
}
