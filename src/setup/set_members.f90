!> The control points of a blank that belong to a named set.
module set_members
  use kinds, only: wp
  use seams, only: seams_t, collect, largest_of_groups, distribute
  use scene, only: set_spec_t
  use set_range, only: is_held
  use blank, only: blank_t
  implicit none
  private

  public :: members_t, find_members

  !> Which control points of a patch belong to a set.
  type :: members_t
    logical, allocatable :: is_in(:, :, :)   !! shape (n1, n2, n3)
  end type members_t

contains

  !> Control points of all patches that belong to a set; with one all that it is joined to.
  subroutine find_members(blank, set, members)
    type(blank_t), intent(in) :: blank
    type(set_spec_t), intent(in) :: set
    type(members_t), allocatable, intent(out) :: members(:)   !! by patch
    type(seams_t) :: seams
    real(wp), allocatable :: mark(:, :, :)
    integer :: p

    allocate (members(size(blank%parts)))
    seams = blank%seams
    do p = 1, size(members)
      members(p)%is_in = is_held(blank%parts(p)%element%grid, set, p)
      mark = merge(1.0_wp, 0.0_wp, members(p)%is_in)
      call collect(seams, p, size(mark), 1, mark)
    end do
    if (seams%n_groups == 0) return
    call largest_of_groups(seams, 1)
    do p = 1, size(members)
      mark = merge(1.0_wp, 0.0_wp, members(p)%is_in)
      call distribute(seams, p, size(mark), 1, mark)
      members(p)%is_in = mark > 0.0_wp
    end do
  end subroutine find_members

end module set_members
