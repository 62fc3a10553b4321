!> Strips: solids one element wide in plane strain, worked in the plane.
module plane_strain_element
  use kinds, only: wp
  use block_law, only: block_law_t
  use element, only: element_t, force_report_t
  use solid_patch, only: plane_strain_t
  use solid_element, only: solid_element_t
  use plane_strain_forces, only: forces_in_plane, plane_kernel_of, plane_kernel_name
  implicit none
  private

  public :: strip_of

  !> A solid that is worked in the plane.
  type, extends(solid_element_t), public :: plane_strain_element_t
    type(plane_strain_t) :: plane
  contains
    procedure :: forces
    procedure :: elastic_copy
    procedure :: kernel_name
  end type plane_strain_element_t

contains

  !> The strip that does as a solid whose motion along a coordinate is held everywhere and whose
  !! sides are loaded alike. Not allocated where the solid is not one element wide across the held
  !! coordinate and linear with one point there, or where material or state could move the sides
  !! apart.
  subroutine strip_of(solid, law, component, strip)
    type(solid_element_t), intent(in) :: solid
    class(block_law_t), intent(in) :: law
    integer, intent(in) :: component         !! that is held: 1 x, 2 y, 3 z
    type(plane_strain_element_t), allocatable, intent(out) :: strip
    integer, parameter :: in_plane(4, 3) = reshape([2, 3, 1, 6, 1, 3, 2, 5, 1, 2, 3, 4], [4, 3])
    real(wp) :: width
    integer :: i

    associate (patch => solid%patch, across => solid%patch%axes(2), x => solid%motion%x, &
               places => in_plane(:, component))
      if (any([across%degree, across%n_elements, across%n_points] /= 1)) return
      if (patch%is_rational) return
      if (law%needs_context .or. .not. law%keeps_plane(component)) return
      do i = 1, size(patch%state, 3)
        if (i /= law%eqps_state .and. any(abs(patch%state(:, :, i, :, :)) > 0.0_wp)) return
      end do
      if (any(abs(x(:, 2, :, places(:2)) - x(:, 1, :, places(:2))) > 0.0_wp)) return
      width = x(1, 2, 1, component) - x(1, 1, 1, component)
      if (any(abs(x(:, 2, :, component) - x(:, 1, :, component) - width) &
              > 1.0e-9_wp*abs(width))) return
    end associate
    allocate (strip)
    strip%solid_element_t = solid
    strip%has_own_points = .false.
    strip%is_by_rows = .false.
    strip%can_be_cut = .false.
    associate (patch => solid%patch, plane => strip%plane)
      plane%places = in_plane(:, component)
      plane%across = 0.5_wp*width
      plane%half = merge(0.5_wp, -0.5_wp, component == 2)*width
      allocate (plane%sides(size(patch%tiles)))
      do i = 1, size(patch%tiles)
        associate (tile => patch%tiles(i))
          allocate (plane%sides(i)%force(tile%control_first(1):tile%control_last(1), 1, &
                                         patch%n_control(3), 3))
        end associate
      end do
      plane%kernel = plane_kernel_of(patch%axes%degree, patch%axes%n_points)
    end associate
  end subroutine strip_of

  subroutine forces(self, law, dt, report)
    class(plane_strain_element_t), intent(inout) :: self
    class(block_law_t), intent(in) :: law
    real(wp), intent(in) :: dt
    type(force_report_t), intent(out) :: report

    call forces_in_plane(self%patch, self%plane, law, dt, self%motion%x, self%motion%v, &
                         self%motion%internal_force, report)
  end subroutine forces

  !> A solid, for trial motions may go out of the plane.
  subroutine elastic_copy(self, copy)
    class(plane_strain_element_t), intent(in) :: self
    class(element_t), allocatable, intent(out) :: copy

    call self%solid_element_t%elastic_copy(copy)
  end subroutine elastic_copy

  pure function kernel_name(self) result(name)
    class(plane_strain_element_t), intent(in) :: self
    character(:), allocatable :: name

    name = plane_kernel_name(self%plane%kernel)
  end function kernel_name

end module plane_strain_element
