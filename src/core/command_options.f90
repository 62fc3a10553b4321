!> What the command lines of all programs have in common.
module command_options
  use text, only: string_t, nearest_name, read_integer
  implicit none
  private

  public :: program_arguments, take_count, unknown_option

contains

  !> The arguments that the program was started with.
  function program_arguments() result(arguments)
    type(string_t), allocatable :: arguments(:)
    integer :: i, length

    allocate (arguments(command_argument_count()))
    do i = 1, size(arguments)
      call get_command_argument(i, length=length)
      allocate (character(length) :: arguments(i)%value)
      call get_command_argument(i, value=arguments(i)%value)
    end do
  end function program_arguments

  !> The value of an option that counts something; `reason` is set where it is no count.
  subroutine take_count(option, value, count, reason)
    character(*), intent(in) :: option, value
    integer, intent(inout) :: count
    character(:), allocatable, intent(inout) :: reason
    logical :: is_number

    call read_integer(value, count, is_number)
    if (.not. is_number .or. count < 1) &
      reason = "option "//option//" needs a whole number of at least 1, not '"//value//"'"
  end subroutine take_count

  !> Why a word is no option, with the option most like it where there is one.
  function unknown_option(word, options) result(reason)
    character(*), intent(in) :: word
    type(string_t), intent(in) :: options(:)
    character(:), allocatable :: reason, nearest

    reason = "unknown option '"//word//"'"
    nearest = nearest_name(word, options)
    if (nearest /= "") reason = reason//"; nearest is "//nearest
  end function unknown_option

end module command_options
