// Kalthoff and Winkler's plate and the fragmenting cylinder of CabanaPD's examples (kalthoff_winkler.cpp,
// fragmenting_cylinder.cpp; BSD 3-clause, Oak Ridge National Laboratory), with what impact.py compares. Against the examples:
// one program, the bulk modulus and the radius of contact are inputs, particles at the middles of cells, an energy of motion, and
// at the end end.bin: particles as rows of doubles x, u, v, bonds after the notches, intact bonds, number of the fragment.
// c89a827 does not initialise _min_coord and _max_coord in src/CabanaPD_Comm.hpp, which may duplicate particles on a single rank
// (an eighth of the cylinder's here, then NaN): write {} behind their declarations. Add to examples/mechanics/CMakeLists.txt:
//   add_executable(Beside beside.cpp)
//   target_link_libraries(Beside LINK_PUBLIC CabanaPD)
#include <cstdio>
#include <numeric>
#include <vector>

#include "mpi.h"

#include <Kokkos_Core.hpp>

#include <CabanaPD.hpp>

using Space = Kokkos::DefaultExecutionSpace;
using Memory = typename Space::memory_space;

// A solver whose bonds can be read.
template <class... T>
struct Open : CabanaPD::Solver<T...>
{
    using CabanaPD::Solver<T...>::Solver;

    std::vector<double> bonds()
    {
        auto list = this->neighbor->list();
        auto mu = this->neighbor->brokenBonds();
        std::vector<double> found( this->particles.numLocal() );
        for ( std::size_t i = 0; i < found.size(); i++ )
            for ( std::size_t n = 0; n < count( list, i ); n++ )
                found[i] += mu( i, n );
        return found;
    }

    std::vector<int> fragments()
    {
        auto list = this->neighbor->list();
        auto mu = this->neighbor->brokenBonds();
        std::vector<int> root( this->particles.numLocal() );
        std::iota( root.begin(), root.end(), 0 );
        auto top = [&]( int i )
        {
            while ( root[i] != i )
                i = root[i] = root[root[i]];
            return i;
        };
        for ( std::size_t i = 0; i < root.size(); i++ )
            for ( std::size_t n = 0; n < count( list, i ); n++ )
                if ( mu( i, n ) )
                    root[top( i )] = top( Cabana::NeighborList<std::decay_t<decltype( list )>>::getNeighbor( list, i, n ) );
        for ( std::size_t i = 0; i < root.size(); i++ )
            root[i] = top( i );
        return root;
    }

    void write( const std::vector<double>& whole )
    {
        auto x = this->particles.sliceReferencePosition();
        auto u = this->particles.sliceDisplacement();
        auto v = this->particles.sliceVelocity();
        auto rho = this->particles.sliceDensity();
        auto volume = this->particles.sliceVolume();
        auto energy = this->particles.sliceStrainEnergy();
        auto now = bonds();
        auto fragment = fragments();
        double kinetic = 0, stored = 0, broken = 0, directed = 0;
        auto file = std::fopen( "end.bin", "wb" );
        for ( std::size_t i = 0; i < now.size(); i++ )
        {
            double row[12] = { x( i, 0 ), x( i, 1 ), x( i, 2 ), u( i, 0 ), u( i, 1 ), u( i, 2 ), v( i, 0 ), v( i, 1 ), v( i, 2 ), whole[i], now[i], double( fragment[i] ) };
            std::fwrite( row, sizeof row, 1, file );
            kinetic += 0.5 * rho( i ) * volume( i ) * ( row[6] * row[6] + row[7] * row[7] + row[8] * row[8] );
            stored += energy( i ) * volume( i );
            directed += whole[i];
            broken += 0.5 * ( whole[i] - now[i] );
        }
        std::fclose( file );
        std::printf( "RESULT {\"particles\": %zu, \"directed bonds\": %.0f, \"broken bonds\": %.0f, \"kinetic, J\": %.12g, \"stored, J\": %.12g}\n", now.size(), directed, broken, kinetic, stored );
    }

    // As run of CabanaPD, but a bond that breaks acts once more in the second half of its step, as in peri.
    template <class Hold, class Unbreakable>
    void late( Hold hold, Unbreakable unbreakable )
    {
        for ( int step = 1; step <= this->num_steps; step++ )
        {
            this->integrator->initialHalfStep( Space{}, this->particles );
            computeForce( unbreakable, *this->force, this->particles, *this->neighbor );
            hold();
            this->integrator->finalHalfStep( Space{}, this->particles );
            this->updateForce();
            hold();
        }
        computeEnergy( this->force_model, *this->force, this->particles, *this->neighbor );
    }

  private:
    template <class List>
    static std::size_t count( const List& list, std::size_t i )
    {
        return Cabana::NeighborList<List>::numNeighbor( list, i );
    }
};
template <class P, class F>
Open( CabanaPD::Inputs, P, F ) -> Open<P, F>;
template <class P, class F, class C>
Open( CabanaPD::Inputs, P, F, C ) -> Open<P, F, C>;

void plate( CabanaPD::Inputs inputs )
{
    double rho0 = inputs["density"], K = inputs["bulk_modulus"], G0 = inputs["fracture_energy"], horizon = inputs["horizon"];
    horizon += 1e-10;
    std::array<double, 3> low = inputs["low_corner"], high = inputs["high_corner"], size = inputs["system_size"];
    std::array<int, 3> cells = inputs["num_cells"];
    int m = std::floor( horizon / ( ( high[0] - low[0] ) / cells[0] ) );

    double height = size[0], thickness = size[2], y1 = -size[1] / 8, y2 = size[1] / 8;
    Kokkos::Array<double, 3> p1 = { low[0], y1, low[2] }, p2 = { low[0], y2, low[2] };
    Kokkos::Array<double, 3> v1 = { height / 2, 0, 0 }, v2 = { 0, 0, thickness };
    Kokkos::Array<Kokkos::Array<double, 3>, 2> places = { p1, p2 };
    CabanaPD::Prenotch<2> prenotch( v1, v2, places );

    CabanaPD::ForceModel model( CabanaPD::PMB{}, horizon, K, G0 );
    CabanaPD::Particles particles( Memory{}, CabanaPD::PMB{} );
    particles.domain( low, high, cells, m + 1 );
    particles.create( Space{} );
    auto rho = particles.sliceDensity();
    auto x = particles.sliceReferencePosition();
    auto v = particles.sliceVelocity();
    double dx = particles.dx[0], v0 = inputs["impactor_velocity"];
    auto start = KOKKOS_LAMBDA( const int i )
    {
        rho( i ) = rho0;
        if ( x( i, 1 ) > y1 && x( i, 1 ) < y2 && x( i, 0 ) < -0.5 * height + dx )
            v( i, 0 ) = v0;
    };
    particles.update( Space{}, start );

    Open solver( inputs, particles, model );
    double side = -0.5 * height;
    CabanaPD::Region<CabanaPD::RectangularPrism> plane( side - dx, side + dx, y1 - 0.25 * dx, y2 + 0.25 * dx, -thickness, thickness );
    auto held = createBoundaryCondition( CabanaPD::ForceValueBCTag{}, 0.0, Space{}, solver.particles, plane );
    solver.init( held, prenotch );
    auto whole = solver.bonds();
    if ( inputs.contains( "late" ) )
    {
        solver.late( [&] { held.apply( Space{}, solver.particles, 0 ); }, CabanaPD::ForceModel( CabanaPD::PMB{}, horizon, K, 1e20 ) );
    }
    else
        solver.run( held );
    solver.write( whole );
}

template <class Particles, class... Models>
void cylinder( CabanaPD::Inputs inputs, Particles& particles, Models... models )
{
    std::array<double, 3> low = inputs["low_corner"], high = inputs["high_corner"];
    std::array<int, 3> cells = inputs["num_cells"];
    double outer = inputs["cylinder_outer_radius"], inner = inputs["cylinder_inner_radius"], half = inputs["cylinder_height"];
    half *= 0.5;
    double horizon = inputs["horizon"];
    int m = std::floor( horizon / ( ( high[0] - low[0] ) / cells[0] ) );
    particles.domain( low, high, cells, m + 1 );
    auto inside = KOKKOS_LAMBDA( const int, const double x[3] )
    {
        double square = x[0] * x[0] + x[1] * x[1];
        return square >= inner * inner && square <= outer * outer && x[2] <= half && x[2] >= -half;
    };
    particles.create( Space{}, Cabana::InitUniform{}, inside );
    auto rho = particles.sliceDensity();
    auto x = particles.sliceReferencePosition();
    auto v = particles.sliceVelocity();
    double rho0 = inputs["density"], most = inputs["max_radial_velocity"], less = inputs["min_radial_velocity"], up = inputs["max_vertical_velocity"];
    auto start = KOKKOS_LAMBDA( const int i )
    {
        rho( i ) = rho0;
        double z = x( i, 2 ) / half, vr = most - less * z * z, angle = Kokkos::atan2( x( i, 1 ), x( i, 0 ) );
        v( i, 0 ) = vr * Kokkos::cos( angle );
        v( i, 1 ) = vr * Kokkos::sin( angle );
        v( i, 2 ) = up * z;
    };
    particles.update( Space{}, start );
    Open solver( inputs, particles, models... );
    solver.init();
    auto whole = solver.bonds();
    bool ran = false;
    if constexpr ( sizeof...( models ) == 1 )
        if ( inputs.contains( "late" ) )
        {
            double K = inputs["bulk_modulus"];
            solver.late( [] {}, CabanaPD::ForceModel( CabanaPD::PMB{}, horizon + 1e-10, K, 1e20 ) );
            ran = true;
        }
    if ( !ran )
        solver.run();
    solver.write( whole );
}

int main( int argc, char* argv[] )
{
    MPI_Init( &argc, &argv );
    Kokkos::initialize( argc, argv );
    {
        CabanaPD::Inputs inputs( argv[1] );
        if ( !inputs.contains( "cylinder_height" ) )
            plate( inputs );
        else
        {
            double K = inputs["bulk_modulus"], stretch = inputs["critical_stretch"], horizon = inputs["horizon"];
            horizon += 1e-10;
            CabanaPD::ForceModel model( CabanaPD::PMB{}, horizon, K, 9 * K * horizon * stretch * stretch / 5 );
            double radius = inputs["contact_radius"], skin = inputs["contact_skin"];
            if ( radius > 0 )
            {
                CabanaPD::Particles particles( Memory{}, CabanaPD::NormalRepulsionModel{} );
                cylinder( inputs, particles, model, CabanaPD::NormalRepulsionModel( horizon, radius, skin, K ) );
            }
            else
            {
                CabanaPD::Particles particles( Memory{}, CabanaPD::PMB{} );
                cylinder( inputs, particles, model );
            }
        }
    }
    Kokkos::finalize();
    MPI_Finalize();
}
