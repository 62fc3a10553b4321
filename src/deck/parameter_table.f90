!> Parameters of a deck: names with a number or a text, and what the command line says instead.
module parameter_table
  use kinds, only: wp
  use text, only: string_t, upper_case, to_text, nearest_name
  use name_table, only: name_table_t, insert, place_of
  implicit none
  private

  public :: parameter_table_t, parameter_t, find_parameter, define_parameter, nearest_parameter

  !> A number or, for what the deck wrote in quotes, a text.
  type :: parameter_t
    logical :: is_text = .false.
    real(wp) :: number = 0.0_wp
    character(:), allocatable :: words   !! the text, or the number as text
    character(:), allocatable :: name    !! as the deck spells it
    integer :: block = 0                 !! number of the keyword that defines it
  end type parameter_t

  !> All parameters so far, in the order of their definition. Case does not matter.
  type :: parameter_table_t
    type(name_table_t) :: names
    type(parameter_t), allocatable :: items(:)   !! longer than the number of names
  end type parameter_table_t

contains

  !> Place of a parameter in `items`, 0 if there is none of that name.
  pure integer function find_parameter(table, name)
    type(parameter_table_t), intent(in) :: table
    character(*), intent(in) :: name

    find_parameter = place_of(table%names, upper_case(name))
  end function find_parameter

  !> Enter a parameter; one that is there already keeps its value and `is_new` is false.
  pure subroutine define_parameter(table, name, parameter, is_new)
    type(parameter_table_t), intent(inout) :: table
    character(*), intent(in) :: name
    type(parameter_t), intent(in) :: parameter
    logical, intent(out) :: is_new
    type(parameter_t), allocatable :: longer(:)
    integer :: n

    call insert(table%names, upper_case(name), is_new)
    if (.not. is_new) return
    n = table%names%n_names
    if (.not. allocated(table%items)) allocate (table%items(16))
    if (n > size(table%items)) then
      allocate (longer(2*n))
      longer(:n - 1) = table%items(:n - 1)
      call move_alloc(longer, table%items)
    end if
    table%items(n) = parameter
    table%items(n)%name = name
    if (.not. parameter%is_text) table%items(n)%words = to_text(parameter%number)
  end subroutine define_parameter

  !> A parameter named much like `name`, empty where there is none.
  pure function nearest_parameter(table, name) result(nearest)
    type(parameter_table_t), intent(in) :: table
    character(*), intent(in) :: name
    character(:), allocatable :: nearest

    nearest = ""
    if (table%names%n_names == 0) return
    nearest = nearest_name(name, table%names%names(:table%names%n_names))
  end function nearest_parameter

end module parameter_table
