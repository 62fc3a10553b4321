!> Small bodies of every kind for the tests of stiffness and frequencies.
module body_cases
  use kinds, only: wp
  use failure, only: error_t
  use text, only: to_text
  use nurbs_solid, only: nurbs_solid_t
  use round_solids, only: round_shape_t, cylinder_solids
  use elastic, only: new_elastic
  use block_law, only: block_law_t
  use strain_projection, only: projection_spec_t
  use scene, only: patch_spec_t
  use shell_joints, only: set_stiffness
  use vibration, only: fixed_t
  use blank, only: blank_t, new_blank
  use element_cases, only: axis_with, bent, box, weighted
  implicit none
  private

  public :: new_case, new_thin_sheet, hold_nothing, hold_where, tie_rows

  integer, parameter, public :: n_cases = 8
  integer, parameter, public :: quadratic = 1, cubic = 2, seam = 3, fold = 4, disk = 5, &
                                symmetric = 6, smooth = 7, projected = 8
  integer, parameter, public :: apart = 9      !! two bodies, not among the `n_cases`

contains

  !> A body, and what is held of it.
  subroutine new_case(number, body, fixed)
    integer, intent(in) :: number
    type(blank_t), intent(out) :: body
    type(fixed_t), allocatable, intent(out) :: fixed(:)
    type(nurbs_solid_t), allocatable :: solids(:)
    type(projection_spec_t) :: projection
    type(round_shape_t) :: shape
    type(error_t), allocatable :: error

    if (any(number == [quadratic, cubic, symmetric, smooth, projected])) allocate (solids(1))
    select case (number)
    case (quadratic, projected)
      solids(1) = weighted(bent(box([2, 2, 2], [6, 4, 1], [6.0_wp, 4.0_wp, 1.0_wp], 0.2_wp), &
                                0.05_wp), 0.1_wp)
    case (cubic)
      solids(1) = box([3, 3, 2], [5, 2, 1], [6.0_wp, 4.0_wp, 1.0_wp], multiplicity=[2, 1, 1])
    case (seam)
      solids = two_boxes([2, 2, 1])
    case (fold)
      solids = two_boxes([2, 2, 1])
      call fold_up(solids(2))
    case (apart)
      solids = two_boxes([2, 2, 1])
      solids(2)%points(:, :, :, 1) = solids(2)%points(:, :, :, 1) + 1.0_wp
    case (disk)
      shape%radius = 5.0_wp
      shape%height = 0.2_wp
      shape%degrees = [2, 1]
      shape%n_elements = [2, 2, 1]
      call cylinder_solids(shape, 3, solids, error)
      if (allocated(error)) error stop "the disk of the test is wrong"
    case (symmetric)
      solids(1) = box([2, 3, 1], [6, 5, 1], [6.0_wp, 4.0_wp, 0.2_wp])
    case (smooth)
      solids(1) = box([2, 2, 2], [4, 2, 1], [6.0_wp, 4.0_wp, 1.0_wp])
      projection%kind = 1
      projection%is_smooth = .true.
    end select
    if (number == projected) projection%kind = 1
    call set_body(solids, any(number == [fold, disk, symmetric]), projection, body)
    call hold_nothing(body, fixed)
    if (number == cubic) call hold_where(body, 1, 0.0_wp, fixed)
    if (number == seam) call hold_where(body, 1, 4.0_wp, fixed)
    if (number == fold) call hold_where(body, 2, 0.0_wp, fixed)
    if (number == symmetric) call tie_rows(fixed(1))
  end subroutine new_case

  !> A free shell of 100 x 100.
  subroutine new_thin_sheet(thickness, body, fixed)
    real(wp), intent(in) :: thickness
    type(blank_t), intent(out) :: body
    type(fixed_t), allocatable, intent(out) :: fixed(:)
    type(nurbs_solid_t) :: solids(1)
    type(projection_spec_t) :: none

    solids(1) = box([2, 2, 1], [10, 10, 1], [100.0_wp, 100.0_wp, thickness])
    call set_body(solids, .true., none, body)
    call hold_nothing(body, fixed)
  end subroutine new_thin_sheet

  !> Two boxes that meet at x = 4.
  function two_boxes(degrees) result(solids)
    integer, intent(in) :: degrees(3)
    type(nurbs_solid_t) :: solids(2)

    solids(1) = box(degrees, [4, 3, 1], [4.0_wp, 3.0_wp, 0.2_wp])
    solids(2) = solids(1)
    solids(2)%points(:, :, :, 1) = solids(2)%points(:, :, :, 1) + 4.0_wp
  end function two_boxes

  !> Turn what lies beyond x = 4 about the line there, at half the thickness.
  subroutine fold_up(solid)
    type(nurbs_solid_t), intent(inout) :: solid
    real(wp), parameter :: angle = 1.0_wp
    real(wp), allocatable :: x(:, :, :), z(:, :, :)

    x = solid%points(:, :, :, 1) - 4.0_wp
    z = solid%points(:, :, :, 3) - 0.1_wp
    solid%points(:, :, :, 1) = 4.0_wp + x*cos(angle) - z*sin(angle)
    solid%points(:, :, :, 3) = 0.1_wp + x*sin(angle) + z*cos(angle)
  end subroutine fold_up

  subroutine set_body(solids, is_shell, projection, body)
    type(nurbs_solid_t), intent(in) :: solids(:)
    logical, intent(in) :: is_shell
    type(projection_spec_t), intent(in) :: projection
    type(blank_t), intent(out) :: body
    type(patch_spec_t) :: patches(size(solids))
    class(block_law_t), allocatable :: law
    type(error_t), allocatable :: error
    integer :: p

    do p = 1, size(solids)
      patches(p)%name = "p"//to_text(p)
      patches(p)%solid = solids(p)
      patches(p)%n_points = solids(p)%axes%degree + 1
      if (is_shell) patches(p)%n_points(:2) = solids(p)%axes(:2)%degree
    end do
    allocate (law, source=new_elastic(7.85e-9_wp, 2.1e5_wp, 0.3_wp))
    call new_blank(body, "sheet", patches, law, [0.0_wp, 0.0_wp], error, 1.0e-6_wp, projection, &
                   is_shell)
    if (allocated(error)) error stop "the body of the test is wrong"
    if (is_shell) &
      call set_stiffness(body%joints, body%parts, body%seams, body%law, huge(1.0_wp))
  end subroutine set_body

  subroutine hold_nothing(body, fixed)
    type(blank_t), intent(in) :: body
    type(fixed_t), allocatable, intent(out) :: fixed(:)
    integer :: p

    allocate (fixed(size(body%parts)))
    do p = 1, size(fixed)
      associate (x => body%parts(p)%element%motion%x)
        allocate (fixed(p)%is_fixed(size(x, 1), size(x, 2), size(x, 3), 3), source=.false.)
      end associate
    end do
  end subroutine hold_nothing

  !> Hold the control points at a place along an axis.
  subroutine hold_where(body, axis, place, fixed)
    type(blank_t), intent(in) :: body
    integer, intent(in) :: axis
    real(wp), intent(in) :: place
    type(fixed_t), intent(inout) :: fixed(:)
    integer :: p, c

    do p = 1, size(fixed)
      do c = 1, 3
        where (abs(body%parts(p)%element%motion%x(:, :, :, axis) - place) < 1.0e-9_wp) &
          fixed(p)%is_fixed(:, :, :, c) = .true.
      end do
    end do
  end subroutine hold_where

  !> A plane of symmetry at the low end of axis 1 of a shell: the next row moves along it alike.
  subroutine tie_rows(fixed)
    type(fixed_t), intent(inout) :: fixed
    integer :: n(4), i, j, c

    n = shape(fixed%is_fixed)
    fixed%is_fixed(1, :, :, 1) = .true.
    fixed%leader = [(i, i=1, size(fixed%is_fixed))]
    do c = 2, 3
      do j = 1, n(2)
        i = 1 + n(1)*(j - 1 + n(2)*(c - 1))
        fixed%leader(i + 1) = i
      end do
    end do
  end subroutine tie_rows

end module body_cases
