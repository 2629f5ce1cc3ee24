//! Result files of other programs: valid, damaged, and with unknown names.

use super::*;

fn file(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/thermal").join(name)
}

/// Files written by VTK and netCDF (`make.py` beside them): T = 400 + 100 x + 10 y + z + t.
#[test]
fn files_of_other_programs() {
    for (name, array) in [
        ("blocks.pvd", None),
        ("blocks.pvd", Some("Temperature")),
        ("blocks.e", Some("temperature")),
        ("blocks-netcdf4.e", Some("temperature")),
    ] {
        let analysis = open(&file(name), array).unwrap();
        let cells = &analysis.cells;
        assert_eq!((analysis.points.len(), cells.types.as_slice()), (14, &[12, 12, 13][..]), "{name}");
        assert_eq!(cells.connectivity[16..], [2, 12, 5, 8, 13, 11], "{name}");
        let points = analysis.points;
        let mut times = Vec::new();
        for frame in analysis.frames {
            let frame = frame.unwrap();
            times.push(frame.time);
            for ([x, y, z], found) in points.iter().zip(&frame.temperature) {
                let expected = 400.0 + 100.0 * x + 10.0 * y + z + frame.time;
                assert!((found - expected).abs() < 1e-9, "{name}: {found}, {expected}");
            }
        }
        assert_eq!(times, [0.0, 2.0, 5.0], "{name}");
    }
}

/// A plane strip as MOOSE writes it (`make.py`): two axes, QUAD4.
#[test]
fn exodus_in_two_dimensions() {
    let analysis = open(&file("strip.e"), None).unwrap();
    assert_eq!((analysis.points[5], analysis.cells.types.as_slice()), ([2.0, 1.0, 0.0], &[9, 9][..]));
    assert_eq!(analysis.cells.connectivity, [0, 1, 4, 3, 1, 2, 5, 4]);
    let frames: Vec<ThermalFrame> = analysis.frames.collect::<Result<_, _>>().unwrap();
    assert_eq!((frames.len(), frames[2].time, frames[2].temperature[5]), (3, 5.0, 615.0));
}

#[test]
fn unknown_names_are_refused() {
    for (name, array, says) in [
        ("blocks.e", None, "allowed: one nodal scalar array"),
        ("blocks.e", Some("temprature"), "allowed: velocity, temperature"),
        ("blocks.pvd", Some("T"), "allowed: Temperature"),
        ("make.py", None, "allowed: frd, pvd, vtu, pvtu, xdmf"),
    ] {
        let error = open(&file(name), array).err().unwrap().to_string();
        assert!(error.contains(says), "{name}: {error}");
    }
}

/// A file truncated anywhere, or with any byte changed, gives an error or other numbers, but no panic, and
/// needs no more memory than a file can fill.
#[test]
fn damaged_files() {
    let directory = tempfile::tempdir().unwrap();
    for name in ["blocks_0.vtu", "blocks_1.vtu", "blocks_2.vtu", "blocks.e", "blocks-netcdf4.e"] {
        let good = std::fs::read(file(name)).unwrap();
        let path = directory.path().join(name);
        let mut refused = 0;
        let mut read = |bytes: &[u8]| {
            std::fs::write(&path, bytes).unwrap();
            let array = if name.ends_with(".e") { "temperature" } else { "Temperature" };
            let whole = open(&path, Some(array)).and_then(|analysis| {
                analysis.frames.collect::<Result<Vec<ThermalFrame>, Error>>().map(|frames| frames.len())
            });
            refused += usize::from(whole.is_err());
        };
        let stride = 1 + good.len() / 700;
        for place in (0..good.len()).step_by(stride) {
            read(&good[..place]);
            let mut changed = good.clone();
            changed[place] ^= 0xff;
            read(&changed);
            changed[place] = good[place] ^ 0x04;
            read(&changed);
        }
        assert!(refused > good.len() / stride, "{name}: {refused}");
    }
}

/// T = 300 + 10 x + y at t = 0, 5 K more at t = 2.5 s, at six nodes of a strip of two quadrilaterals, in the
/// formats of other programs.
#[test]
fn shapes_of_fewer_dimensions_and_parts() {
    let directory = tempfile::tempdir().unwrap();
    let at = |name: &str| directory.path().join(name);
    let write = |name: &str, text: String| std::fs::write(at(name), text).unwrap();
    let points = [[0, 0], [1, 0], [2, 0], [0, 1], [1, 1], [2, 1]];
    let values = |time: i32, own: &[[i32; 2]]| -> String {
        own.iter().map(|[x, y]| format!("{} ", 300 + 10 * x + y + 2 * time)).collect()
    };
    let places = |own: &[[i32; 2]]| -> String { own.iter().map(|[x, y]| format!("{x} {y} 0 ")).collect() };
    let array = |name: &str, kind: &str, text: &str| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
    };
    let vtu = |time, own: &[[i32; 2]], nodes: &str, ends: &str, kinds: &str| {
        format!(
            "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece \
             NumberOfPoints=\"{}\"><Points>{}</Points><Cells>{}{}{}</Cells><PointData>{}</PointData></Piece></UnstructuredGrid></VTKFile>",
            own.len(),
            array("Points", "Float64", &places(own)).replace(" Name", " NumberOfComponents=\"3\" Name"),
            array("connectivity", "Int32", nodes),
            array("offsets", "Int32", ends),
            array("types", "UInt8", kinds),
            array("T", "Float64", &values(time, own))
        )
    };
    let whole = |time| vtu(time, &points, "0 1 4 3 1 2 5 4", "4 8", "9 9");
    let part = |time, k: usize| {
        vtu(time, &[points[k], points[k + 1], points[k + 3], points[k + 4]], "0 1 3 2", "4", "9")
    };
    let empty = "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece \
        NumberOfPoints=\"0\"></Piece></UnstructuredGrid></VTKFile>";
    write("empty.vtu", empty.into());
    write("whole.vtu", whole(0));
    for time in [0, 1] {
        write(&format!("t{time}.vtu"), whole(time));
        (0..2).for_each(|k| write(&format!("t{time}_{k}.vtu"), part(time, k)));
        let pieces = format!(
            "<Piece Source=\"t{time}_0.vtu\"/><Piece Source=\"empty.vtu\"/><Piece Source=\"t{time}_1.vtu\"/>"
        );
        let head = "<VTKFile type=\"PUnstructuredGrid\"><PUnstructuredGrid GhostLevel=\"0\">";
        write(&format!("t{time}.pvtu"), format!("{head}{pieces}</PUnstructuredGrid></VTKFile>"));
    }
    let pvd = |files: &[(&str, &str)]| {
        let sets = files
            .iter()
            .map(|(time, file)| format!("<DataSet timestep=\"{time}\" part=\"0\" file=\"{file}\"/>"));
        format!(
            "<VTKFile type=\"Collection\"><Collection>{}</Collection></VTKFile>",
            sets.collect::<String>()
        )
    };
    write("vtu.pvd", pvd(&[("0", "t0.vtu"), ("2.5", "t1.vtu")]));
    write("pvtu.pvd", pvd(&[("0", "t0.pvtu"), ("2.5", "t1.pvtu")]));
    write(
        "parts.pvd",
        pvd(&[("0", "t0_0.vtu"), ("0", "t0_1.vtu"), ("2.5", "t1_0.vtu"), ("2.5", "t1_1.vtu")]),
    );
    write("line.vtu", vtu(0, &points[..3], "0 1 1 2", "2 4", "3 3"));
    write("polyline.vtu", vtu(0, &points[..3], "0 1 2", "3", "4"));
    write("second.vtu", vtu(0, &points[..3], "0 2 1", "3", "21"));
    write("pixels.vtu", vtu(0, &points, "0 1 3 4 1 2 4 5", "4 8", "8 8"));
    write("mixed.vtu", vtu(0, &points, "0 1 4 3 1 2 5 1 5 4", "4 7 10", "70 69 5"));

    // hand-written XDMF: text, mixed cells, two axes; separate mesh with included references; HDF5
    let item = |dimensions: &str, text: &str| {
        format!("<DataItem Dimensions=\"{dimensions}\" NumberType=\"Float\" Format=\"XML\">{text}</DataItem>")
    };
    let scalar = |time: i32| {
        format!(
            "<Attribute Name=\"T\" AttributeType=\"Scalar\" Center=\"Node\">{}</Attribute>",
            item("6 1", &values(time, &points))
        )
    };
    let flat: String = points.iter().map(|[x, y]| format!("{x} {y} ")).collect();
    let geometry = format!("<Geometry GeometryType=\"XY\">{}</Geometry>", item("6 2", &flat));
    let quads = "<Topology TopologyType=\"Quadrilateral\" NumberOfElements=\"2\"><DataItem Dimensions=\"2 \
        4\" Format=\"XML\">0 1 4 3 1 2 5 4</DataItem></Topology>";
    let mixed = "<Topology Type=\"Mixed\"><DataItem Dimensions=\"13\" Format=\"XML\">5 0 1 4 3 4 1 2 5 4 1 \
        5 4</DataItem></Topology>";
    let xdmf = |text: String| {
        format!(
            "<?xml version=\"1.0\"?>\n<Xdmf Version=\"3.0\" xmlns:xi=\"http://www.w3.org/2001/XInclude\">\
                         <Domain>{text}</Domain></Xdmf>"
        )
    };
    let include =
        "<xi:include xpointer=\"xpointer(/Xdmf/Domain/Grid[1]/*[self::Topology or self::Geometry])\"/>";
    let grid = |text: &str| format!("<Grid Name=\"g\" GridType=\"Uniform\">{text}</Grid>");
    let collection =
        |grids: String| format!("<Grid GridType=\"Collection\" CollectionType=\"Temporal\">{grids}</Grid>");
    let timed = |time: i32, value: &str, more: &str| {
        grid(&format!("{more}<Time Value=\"{value}\"/>{}", scalar(time)))
    };
    let mesh = format!("{geometry}{quads}");
    write("own.xdmf", xdmf(collection(timed(0, "0", &mesh) + &timed(1, "2.5", &mesh))));
    write(
        "fenics.xdmf",
        xdmf(grid(&mesh) + &collection(timed(0, "0.0", include) + &timed(1, "2.5e0", include))),
    );
    let list = "<Time TimeType=\"List\"><DataItem Dimensions=\"2\" Format=\"XML\">0 2.5</DataItem></Time>";
    let untimed = |time| grid(&format!("{geometry}{mixed}{}", scalar(time)));
    write("list.xmf", xdmf(collection(list.to_owned() + &untimed(0) + &untimed(1))));
    write("steady.xdmf", xdmf(grid(&format!("{mesh}{}", scalar(0)))));
    let file = rust_hdf5::H5File::create(at("numbers.h5")).unwrap();
    let numbers: Vec<f32> = points.iter().map(|[x, y]| (300 + 10 * x + y) as f32).collect();
    file.new_dataset::<f32>().shape([6, 1]).create("T0").unwrap().write_raw(&numbers).unwrap();
    let own: Vec<f64> = points.iter().flat_map(|[x, y]| [f64::from(*x), f64::from(*y), 0.0]).collect();
    file.new_dataset::<f64>().shape([6, 3]).create("xyz").unwrap().write_raw(&own).unwrap();
    file.new_dataset::<i64>()
        .shape([2, 4])
        .create("cells")
        .unwrap()
        .write_raw(&[0_i64, 1, 4, 3, 1, 2, 5, 4])
        .unwrap();
    file.close().unwrap();
    let hdf =
        |name: &str| format!("<DataItem Dimensions=\"0\" Format=\"HDF\">\n numbers.h5:/{name}\n</DataItem>");
    let h5 = format!(
        "<Geometry GeometryType=\"XYZ\">{}</Geometry><Topology \
         TopologyType=\"Quadrilateral\">{}</Topology><Attribute Name=\"T\">{}</Attribute>",
        hdf("xyz"),
        hdf("cells"),
        hdf("T0")
    );
    write("hdf.xdmf", xdmf(grid(&h5)));
    let bytes: Vec<u8> = points.iter().flat_map(|[x, y]| f64::from(300 + 10 * x + y).to_be_bytes()).collect();
    std::fs::write(at("numbers.bin"), [vec![0; 3], bytes].concat()).unwrap();
    let binary = "<Attribute Name=\"T\"><DataItem Dimensions=\"6\" NumberType=\"Float\" Precision=\"8\" \
        Endian=\"Big\" Seek=\"3\" Format=\"Binary\">numbers.bin</DataItem></Attribute>";
    write("binary.xdmf", xdmf(grid(&format!("{mesh}{binary}"))));

    // truncated anywhere, or with any byte changed: an error or other numbers
    for name in ["list.xmf", "hdf.xdmf", "binary.xdmf"] {
        let good = std::fs::read(at(name)).unwrap();
        let damaged = at("damaged.xdmf");
        for place in 0..good.len() {
            let mut changed = good.clone();
            changed[place] ^= [0x02, 0x10][place % 2];
            for bytes in [&good[..place], &changed[..]] {
                std::fs::write(&damaged, bytes).unwrap();
                let read = open(&damaged, None).map(|analysis| analysis.frames.count());
                assert!(read.is_err() || bytes.len() == good.len(), "{name}: {place}");
            }
        }
    }

    let both = &[0.0, 2.5][..];
    for (name, nodes, types, times) in [
        ("whole.vtu", 6, &[9, 9][..], &both[..1]),
        ("t1.pvtu", 8, &[9, 9], &both[..1]),
        ("vtu.pvd", 6, &[9, 9], both),
        ("pvtu.pvd", 8, &[9, 9], both),
        ("parts.pvd", 8, &[9, 9], both),
        ("line.vtu", 3, &[3, 3], &both[..1]),
        ("polyline.vtu", 3, &[3, 3], &both[..1]),
        ("second.vtu", 3, &[3], &both[..1]),
        ("pixels.vtu", 6, &[9, 9], &both[..1]),
        ("mixed.vtu", 6, &[9, 5, 5], &both[..1]),
        ("own.xdmf", 6, &[9, 9], both),
        ("fenics.xdmf", 6, &[9, 9], both),
        ("list.xmf", 6, &[9, 5, 5], both),
        ("steady.xdmf", 6, &[9, 9], &both[..1]),
        ("hdf.xdmf", 6, &[9, 9], &both[..1]),
        ("binary.xdmf", 6, &[9, 9], &both[..1]),
    ] {
        let analysis = open(&at(name), None).unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!((analysis.points.len(), analysis.cells.types.as_slice()), (nodes, types), "{name}");
        let frames: Vec<ThermalFrame> =
            analysis.frames.collect::<Result<_, _>>().unwrap_or_else(|error| panic!("{name}: {error}"));
        assert_eq!(frames.iter().map(|frame| frame.time).collect::<Vec<f64>>(), times, "{name}");
        for (index, frame) in frames.iter().enumerate() {
            let later = if name == "t1.pvtu" { 1 } else { index };
            for ([x, y, _], found) in analysis.points.iter().zip(&frame.temperature) {
                assert_eq!(*found, 300.0 + 10.0 * x + y + 2.0 * later as f64, "{name}");
            }
        }
    }

    write("missing.pvd", pvd(&[("0", "t0.vtu"), ("1", "t7.vtu")]));
    write("spatial.xdmf", xdmf(collection(grid(&mesh)).replace("Temporal", "Spatial")));
    write("regular.xdmf", xdmf(grid(&mesh.replace("Quadrilateral", "2DCoRectMesh"))));
    write("short.xdmf", xdmf(grid(&format!("{mesh}{}", scalar(0).replace("320 ", "")))));
    write(
        "checkpoint.xdmf",
        xdmf(grid(&format!(
            "{mesh}{}",
            scalar(0).replace("Name=", "ItemType=\"FiniteElementFunction\" Name=")
        ))),
    );
    write("cells.xdmf", xdmf(grid(&format!("{mesh}{}", scalar(0).replace("Node", "Cell")))));
    write("beyond.xdmf", xdmf(grid(&format!("{geometry}{}{}", quads.replace("5 4<", "6 4<"), scalar(0)))));
    write("none.vtu", empty.into());
    write("old.vtk", "# vtk".into());
    for (name, says) in [
        ("missing.pvd", "t7.vtu, which does not exist"),
        ("spatial.xdmf", "spatial collection; allowed: uniform grids"),
        ("regular.xdmf", "\"2DCoRectMesh\"; allowed: mixed, polyvertex"),
        ("short.xdmf", "5 values of `T` at t = 0 s; allowed: 6"),
        ("checkpoint.xdmf", "not as a checkpoint"),
        ("cells.xdmf", "allowed: one nodal scalar array"),
        ("beyond.xdmf", "node 6 in an element; allowed: 0 to 5"),
        ("none.vtu", "no points"),
        ("old.vtk", "save it as .vtu"),
    ] {
        let found = open(&at(name), None).and_then(|analysis| analysis.frames.collect::<Result<Vec<_>, _>>());
        let error = found.err().map(|error| error.to_string()).unwrap_or_default();
        assert!(error.contains(says), "{name}: {error}");
    }
}
