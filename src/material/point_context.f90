!> What only laws of users ask for: kinematics and place of the points of a call. Kept and passed
!! only while such a law is active.
module point_context
  use kinds, only: wp
  implicit none
  private

  public :: point_context_t, new_point_context, number_in_plane, number_through

  !> Kinematics of the n points of a call over one step. Tensors row by row: 11, 12, 13, 21 ...
  type :: point_context_t
    integer :: n = 0                             !! points of the call
    real(wp) :: time = 0.0_wp                    !! total time at the start of the increment
    real(wp) :: step_time = 0.0_wp               !! the same since the step of the deck began
    integer :: step = 1                          !! number of the step of the deck
    integer :: increment = 0                     !! number of the increment in it, from 1
    integer, allocatable :: element(:)           !! element number, from 1, shape (n)
    integer, allocatable :: point(:)             !! integration point number, from 1, shape (n)
    integer :: in_plane = huge(1)                !! points in a layer of a shell, numbered first
    logical, allocatable :: is_owner(:)          !! false: a lane that repeats an element
    !> Deformation gradient at the start, (n, 9); not set where the law needs none.
    real(wp), allocatable :: f0(:, :)
    real(wp), allocatable :: f1(:, :)            !! and at the end of the increment, (n, 9)
    real(wp), allocatable :: place(:, :)         !! coordinates at the end, shape (n, 3)
    real(wp), allocatable :: length(:)           !! cube root of the element's volume, (n)
    integer :: n_fields = 0                      !! temperature and field variables of the deck
    !> These at the start, then at the end of the increment, shape (n, 2*n_fields).
    real(wp), allocatable :: fields(:, :)
  end type point_context_t

contains

  !> A context with room for n points.
  pure function new_point_context(n, n_fields) result(context)
    integer, intent(in) :: n
    integer, intent(in), optional :: n_fields   !! predefined fields
    type(point_context_t) :: context

    context%n = n
    allocate (context%element(n), context%point(n), source=0)
    allocate (context%is_owner(n), source=.true.)
    allocate (context%f0(n, 9), context%f1(n, 9), source=0.0_wp)
    allocate (context%place(n, 3), source=0.0_wp)
    allocate (context%length(n), source=0.0_wp)
    if (present(n_fields)) context%n_fields = n_fields
    allocate (context%fields(n, 2*context%n_fields), source=0.0_wp)
  end function new_point_context

  !> Number of point `l` of a call in its layer (NPT), in a solid in its element.
  pure integer function number_in_plane(context, l) result(number)
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: l

    number = mod(context%point(l) - 1, context%in_plane) + 1
  end function number_in_plane

  !> Number of its layer from the lower face (KSPT), 1 in a solid.
  pure integer function number_through(context, l) result(number)
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: l

    number = (context%point(l) - 1)/context%in_plane + 1
  end function number_through

end module point_context
