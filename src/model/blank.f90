!> The deformable blank: discretisation, law and the fields on its control points.
module blank
  use kinds, only: wp
  use errors, only: error_t
  use nurbs_solid, only: nurbs_solid_t
  use block_law, only: block_law_t
  use ig_patch, only: ig_patch_t, tile_buffer_t, force_report_t
  use strain_projection, only: projection_spec_t
  use patch_setup, only: new_patch, new_tile_buffers
  use lumped_mass, only: new_lumped_mass
  implicit none
  private

  public :: blank_t, motion_t, new_blank, face_slice

  !> Fields on the control points, shape (n1, n2, n3, 3).
  type :: motion_t
    real(wp), allocatable :: x(:, :, :, :)               !! position at the end of the step
    real(wp), allocatable :: v(:, :, :, :)               !! velocity at its middle
    real(wp), allocatable :: internal_force(:, :, :, :)
    real(wp), allocatable :: external_force(:, :, :, :)  !! contact and loads
  end type motion_t

  !> One patch with its law, mass and motion.
  type :: blank_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid                      !! shape at the start
    type(ig_patch_t) :: patch
    type(tile_buffer_t), allocatable :: buffers(:)
    class(block_law_t), allocatable :: law
    real(wp), allocatable :: mass(:, :, :)            !! lumped mass of the control points
    real(wp) :: mass_factor = 1.0_wp                  !! by which scaling has raised it everywhere
    !> Factors on the mass of differences through the thickness, (n1, n2); see `column_scaling`.
    real(wp), allocatable :: column_factor(:, :)
    real(wp) :: added_mass = 0.0_wp                   !! by all scaling
    type(motion_t) :: motion
    type(force_report_t) :: report                    !! of the last force evaluation
  end type blank_t

contains

  !> A blank at rest and without stress. `law` is taken over.
  subroutine new_blank(blank, name, solid, n_points, n_parts, law, viscosity, error, projection)
    type(blank_t), intent(out) :: blank
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: n_points(3), n_parts(3)      !! quadrature, see `new_patch`
    class(block_law_t), allocatable, intent(inout) :: law
    real(wp), intent(in) :: viscosity(2)                !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    type(projection_spec_t), intent(in), optional :: projection   !! absent: none

    call new_patch(blank%patch, solid, n_points, n_parts, law, viscosity, error, projection)
    if (allocated(error)) return
    blank%name = name
    blank%solid = solid
    blank%buffers = new_tile_buffers(blank%patch)
    blank%mass = new_lumped_mass(solid, law%density)
    call move_alloc(law, blank%law)
    associate (motion => blank%motion)
      allocate (motion%x, source=solid%points)
      allocate (motion%v, motion%internal_force, motion%external_force, mold=motion%x)
      motion%v = 0.0_wp
      motion%internal_force = 0.0_wp
      motion%external_force = 0.0_wp
    end associate
  end subroutine new_blank

  !> Bounds (lower, upper) of the control indices of a face: 1 xi_min, 2 xi_max, ... 6 zeta_max.
  pure function face_slice(n, face) result(bounds)
    integer, intent(in) :: n(3), face
    integer :: bounds(3, 2), axis

    axis = (face + 1)/2
    bounds(:, 1) = 1
    bounds(:, 2) = n
    bounds(axis, :) = merge(1, n(axis), mod(face, 2) == 1)
  end function face_slice

end module blank
