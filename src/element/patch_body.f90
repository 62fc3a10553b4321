!> A patch as a body in motion: its shape, tables, mass and the fields on its control points.
module patch_body
  use kinds, only: wp
  use errors, only: error_t
  use text, only: to_text
  use state_store, only: state_store_t, carry_array
  use nurbs_solid, only: nurbs_solid_t
  use seams, only: seams_t, collect, sum_groups, hand_out
  use block_law, only: block_law_t
  use ig_patch, only: ig_patch_t, tile_buffer_t, plane_strain_t
  use strain_projection, only: projection_spec_t
  use patch_setup, only: new_patch, new_tile_buffers
  use shape_check, only: check_shape
  use lumped_mass, only: new_lumped_mass
  implicit none
  private

  public :: new_patch_body, without_state, set_inertia, share_internal_forces, share_external_forces
  public :: carry_fields

  !> A field on the control points or the integration points of one patch.
  type, public :: field_t
    real(wp), allocatable :: values(:, :, :, :)
  end type field_t

  !> Fields on the control points, shape (n1, n2, n3, 3).
  type, public :: motion_t
    real(wp), allocatable :: x(:, :, :, :)               !! position at the end of the step
    real(wp), allocatable :: v(:, :, :, :)               !! velocity at its middle
    real(wp), allocatable :: internal_force(:, :, :, :)
    real(wp), allocatable :: external_force(:, :, :, :)  !! contact and loads
  end type motion_t

  !> One patch with mass and motion. At a seam `mass` is what the patch itself brings, so that sums
  !! over all patches count everything once; `inertia` is what a force there has to move.
  type, public :: patch_body_t
    character(:), allocatable :: name
    type(nurbs_solid_t) :: solid                      !! shape at the start
    type(ig_patch_t) :: patch
    type(tile_buffer_t), allocatable :: buffers(:)
    real(wp), allocatable :: mass(:, :, :)            !! lumped, of the control points
    real(wp), allocatable :: inertia(:, :, :)         !! the same, of all that is joined in a point
    !> Factors on the mass of differences through the thickness, (n1, n2); see `column_scaling`.
    real(wp), allocatable :: column_factor(:, :)
    type(motion_t) :: motion
  end type patch_body_t

contains

  !> A patch at rest and without stress; `set_inertia` must follow when all patches are there.
  subroutine new_patch_body(body, name, solid, n_points, n_parts, law, viscosity, error, &
                            projection)
    type(patch_body_t), intent(out) :: body
    character(*), intent(in) :: name
    type(nurbs_solid_t), intent(in) :: solid
    integer, intent(in) :: n_points(3), n_parts(3)      !! quadrature, see `new_patch`
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: viscosity(2)                !! linear and quadratic factor
    type(error_t), allocatable, intent(out) :: error
    type(projection_spec_t), intent(in), optional :: projection   !! absent: none

    call check_shape(solid, name, error)
    if (allocated(error)) return
    call new_patch(body%patch, solid, n_points, n_parts, law, viscosity, error, projection)
    if (allocated(error)) return
    body%name = name
    body%solid = solid
    body%buffers = new_tile_buffers(body%patch)
    body%mass = new_lumped_mass(solid, law%density)
    associate (motion => body%motion)
      allocate (motion%x, source=solid%points)
      allocate (motion%v, motion%internal_force, motion%external_force, mold=motion%x)
      motion%v = 0.0_wp
      motion%internal_force = 0.0_wp
      motion%external_force = 0.0_wp
    end associate
  end subroutine new_patch_body

  !> Put fields of all patches, or take them back; those not there yet leave nothing. Others in the
  !! store, of another shape, are its fault.
  subroutine carry_fields(store, name, fields)
    type(state_store_t), intent(inout) :: store
    character(*), intent(in) :: name
    type(field_t), allocatable, intent(inout) :: fields(:)
    integer :: p

    if (.not. allocated(fields)) return
    do p = 1, size(fields)
      call carry_array(store, name//"_"//to_text(p), size(fields(p)%values), fields(p)%values)
    end do
  end subroutine carry_fields

  !> Copies of bodies for trial motions of an elastic law, of any kind also in plane strain: no
  !! viscosity, one empty state variable.
  function without_state(bodies) result(trial)
    type(patch_body_t), intent(in) :: bodies(:)
    type(patch_body_t), allocatable :: trial(:)
    integer :: p

    allocate (trial, source=bodies)
    do p = 1, size(trial)
      associate (patch => trial(p)%patch)
        patch%viscosity%is_active = .false.
        patch%plane = plane_strain_t()
        deallocate (patch%state)
        allocate (patch%state(8, patch%axes(3)%n_points, 1, &
                              patch%axes(1)%n_points*patch%axes(2)%n_points, patch%n_blocks), &
                  source=0.0_wp)
      end associate
    end do
  end function without_state

  !> Sum up the masses that meet at seams. To be called again after a change of masses.
  subroutine set_inertia(bodies, seams)
    type(patch_body_t), intent(inout) :: bodies(:)
    type(seams_t), intent(inout) :: seams
    integer :: p

    do p = 1, size(bodies)
      bodies(p)%inertia = bodies(p)%mass
      call collect(seams, p, size(bodies(p)%mass), 1, bodies(p)%mass)
    end do
    call sum_groups(seams, 1)
    do p = 1, size(bodies)
      call hand_out(seams, p, size(bodies(p)%mass), 1, bodies(p)%inertia)
    end do
  end subroutine set_inertia

  !> Sum up the internal forces that meet at seams.
  subroutine share_internal_forces(bodies, seams)
    type(patch_body_t), intent(inout) :: bodies(:)
    type(seams_t), intent(inout) :: seams
    integer :: p

    if (seams%n_groups == 0) return
    do p = 1, size(bodies)
      call collect(seams, p, size(bodies(p)%mass), 3, bodies(p)%motion%internal_force)
    end do
    call sum_groups(seams, 3)
    do p = 1, size(bodies)
      call hand_out(seams, p, size(bodies(p)%mass), 3, bodies(p)%motion%internal_force)
    end do
  end subroutine share_internal_forces

  !> Sum up the forces from outside that meet at seams.
  subroutine share_external_forces(bodies, seams)
    type(patch_body_t), intent(inout) :: bodies(:)
    type(seams_t), intent(inout) :: seams
    integer :: p

    if (seams%n_groups == 0) return
    do p = 1, size(bodies)
      call collect(seams, p, size(bodies(p)%mass), 3, bodies(p)%motion%external_force)
    end do
    call sum_groups(seams, 3)
    do p = 1, size(bodies)
      call hand_out(seams, p, size(bodies(p)%mass), 3, bodies(p)%motion%external_force)
    end do
  end subroutine share_external_forces

end module patch_body
