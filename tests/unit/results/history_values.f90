!> What is entered in a sample of the history, by path.
module history_values
  use kinds, only: wp
  use history, only: history_sample_t
  implicit none
  private

  public :: sample_value, sample_vector

contains

  !> A number of a sample, or a component of a vector; zero where nothing is entered under the path.
  pure real(wp) function sample_value(sample, path, component) result(value)
    type(history_sample_t), intent(in) :: sample
    character(*), intent(in) :: path
    integer, intent(in), optional :: component   !! 1 if absent
    integer :: c
    real(wp) :: values(3)

    c = 1
    if (present(component)) c = component
    values = sample_vector(sample, path, 3)
    value = values(c)
  end function sample_value

  !> A vector of a sample; zero where nothing is entered under the path.
  pure function sample_vector(sample, path, n) result(values)
    type(history_sample_t), intent(in) :: sample
    character(*), intent(in) :: path
    integer, intent(in) :: n
    real(wp) :: values(n)
    integer :: i, last

    values = 0.0_wp
    if (.not. allocated(sample%columns)) return
    do i = 1, size(sample%columns)
      associate (column => sample%columns(i))
        last = min(n, column%n)
        if (column%path == path) values(:last) = sample%values(column%first:column%first + last - 1)
      end associate
    end do
  end function sample_vector

end module history_values
